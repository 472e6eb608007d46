"""The page: what is asked for on it goes to a session, what the session computes is shown on it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import viser

from workbench.errors import WorkbenchError
from workbench.robots.assignments import parse_assignment, resolve_changes
from workbench.studio import words
from workbench.studio.arrange import Panels
from workbench.studio.curves import QUANTITIES, Curves
from workbench.studio.hands import Hands
from workbench.studio.keep import Keep
from workbench.studio.keys import add_keys
from workbench.studio.panels import Knobs
from workbench.studio.pointing import Pointing
from workbench.studio.scene import MARKS, Scene
from workbench.studio.session import AGAINST, Session
from workbench.studio.state import FACTORS
from workbench.studio.worker import Worker

FRAMES_PER_S = 20.0
MARKS_PER_S = 4.0
"""How often the moment is marked in the curves while the motion plays."""
SETTLED_S = 0.6
"""A slider that rests so long has been let go: the next change is another step back."""


class Page:
    """One page on one session; all browsers that open it see the same.

    Parameters
    ----------
    server
        From `workbench.studio.server.start_server`.
    session
        What is shown.
    dark
        Begin dark.
    """

    def __init__(self, server: viser.ViserServer, session: Session, dark: bool = False) -> None:
        self.session, self.server = session, server
        self.sample, self._playing, self._speed, self._dark = 0, False, 1.0, dark
        self._lock = threading.RLock()
        self._settling: threading.Timer | None = None
        self._moved: str | None = None
        """the slider that is in a hand"""
        self._ended = threading.Event()
        self.worker = Worker(self._fault)
        self.hands = Hands(server.get_event_loop(), self._fault)
        server.gui.set_panel_label("workbench studio")
        self._theme()
        self.scene = Scene(server, dark)
        self._results_panel()
        self._controls()
        add_keys(self)
        self._show()
        self.worker.ask("reach", lambda: self._reach(None))
        self._player = threading.Thread(target=self._play, name="studio player", daemon=True)
        self._player.start()

    # building

    def _theme(self) -> None:
        self.server.gui.configure_theme(
            dark_mode=self._dark, show_logo=False, show_share_button=False, control_width="medium"
        )

    def _results_panel(self) -> None:
        gui: Any = self.server.gui
        panel = gui.add_panel()
        with panel.add_tab("Answers"):
            self._head = gui.add_html("")
            self._moment = gui.add_html("")
            self._quantity = gui.add_dropdown("curves of", QUANTITIES)
            self._against = gui.add_dropdown("compare with", AGAINST)
            self._key = gui.add_html("")
            self._plots = gui.add_folder(None)
            self._verdict, self._peaks, self._poses = gui.add_html(""), gui.add_html(""), gui.add_html("")
        Panels(self.server, panel)
        self.curves = Curves(gui)
        self.curves.in_the(self._dark)
        self.hands.listen(self._quantity, lambda _: self.worker.ask("show", self._show))
        self.hands.listen(self._against, self._compare)

    def _controls(self) -> None:
        gui: Any = self.server.gui
        with gui.add_folder("Motion in time"):
            self._play_button = gui.add_button("Play", hint="Space")
            self._time = gui.add_slider(
                "moment", min=0, max=max(len(self.session.good.t) - 1, 1), step=1, initial_value=0
            )
            self._pace = gui.add_slider("pace", min=0.05, max=2.0, step=0.05, initial_value=1.0)
            worst = gui.add_button("Worst moment", hint="where a torque is at its peak")
        steps = gui.add_button_group("changes", ("Undo", "Redo", self.back_words()))
        tabs = gui.add_tab_group()
        with tabs.add_tab("Robot"):
            self.knobs = Knobs(gui, self.session, self.hands, self._knob, self._touched)
            self._typed = gui.add_text(
                "type", initial_value="", hint="a1=0.23, m2*=0.5; Enter; beyond the sliders, too"
            )
            typed = gui.add_button("Set what is typed")
        with tabs.add_tab("Motion"):
            self._motion_tab()
        with tabs.add_tab("Look"):
            self._look_tab()
        with tabs.add_tab("Keep"):
            self.keep = Keep(gui, self.session)
        hands = self.hands
        hands.click(self._play_button, lambda _: self.toggle())
        hands.listen(self._time, self._grabbed)
        hands.listen(self._pace, lambda pace: setattr(self, "_speed", float(pace)))
        hands.click(worst, lambda _: self.worst())
        hands.click(steps, self.step)
        hands.click(typed, lambda _: self._type(self._typed.value))

    def back_words(self) -> str:
        """What the way back is called."""
        sources = (info.source for info in self.session.subject.base.description.table.infos.values())
        return "Back to the paper" if any(source.startswith("[") for source in sources) else "Back to the file"

    def _motion_tab(self) -> None:
        gui: Any = self.server.gui
        session = self.session
        campaign = session.subject.campaign
        self._case = gui.add_dropdown(
            "case", tuple(case.name for case in campaign.case), initial_value=session.wanted.case
        )
        self._amplitude = gui.add_slider("amplitude ×", min=0.1, max=2.0, step=0.01, initial_value=1.0)
        self._fast = gui.add_slider("speed ×", min=0.1, max=4.0, step=0.05, initial_value=1.0)
        gui.add_markdown(
            f"Factors on the case's own motion; {FACTORS[0]:g} to {FACTORS[1]:g} can be typed under Robot."
        )
        with gui.add_folder("held against MuJoCo"):
            self._held = []
            for index, row in enumerate(campaign.candidate):
                kind = "measured" if row.bound is None else f"bound {row.bound:g}"
                box = gui.add_checkbox(
                    f"{row.name} / {row.reference}", index in session.wanted.rows, hint=f"{row.name} against"
                    f" {row.reference}, {kind}{'; the campaign declares that it fails' if row.expect_fail else ''}",
                )  # fmt: skip
                self.hands.listen(box, lambda _: self._hold())
                self._held.append(box)
            if not self._held:
                gui.add_markdown("No formulas. `--candidates FILE` brings some.")
        listen = self.hands.listen
        listen(self._case, lambda case: self._asked(lambda: session.put_on(str(case))))
        listen(self._amplitude, lambda x: self._asked(lambda: session.move("amplitude", amplitude=float(x))))
        listen(self._fast, lambda x: self._asked(lambda: session.move("speed", speed=float(x))))

    def _look_tab(self) -> None:
        gui: Any = self.server.gui
        for mark in MARKS:
            box = gui.add_checkbox(mark, mark in self.scene.shown)
            self.hands.listen(box, partial(self._switched, mark))
        gui.add_markdown(
            "Torques are drawn along the joints' axes in shares of each joint's peak, reactions in shares of the"
            " largest."
        )
        dark = gui.add_checkbox("dark", self._dark)
        self.hands.listen(dark, lambda on: self._darken(bool(on)))
        self.pointing = Pointing(self)

    # asking

    def _asked(self, change: Callable[[], object]) -> None:
        """Change what is wanted; whatever is wrong with it is said on the page."""
        with self._lock:
            self.knobs.forget_reach(self._moved)
            try:
                change()
            except WorkbenchError as error:
                self.session.problem = str(error)
                self._head.content = words.head(self.session)
                return
            self._settle_later()
            self._head.content = words.head(self.session, working=True)
        self.worker.ask("compute", self._compute, drop=("reach",))

    def _touched(self, name: str) -> None:
        self._moved = name

    def _knob(self, name: str, value: float) -> None:
        self._moved = name
        self._asked(lambda: self.session.set(name, value, gesture=name))

    def _hold(self) -> None:
        rows = tuple(index for index, box in enumerate(self._held) if box.value)
        self._asked(lambda: self.session.hold(rows))

    def _type(self, text: str) -> None:
        def change() -> None:
            table = self.session.subject.base.description.table
            parts = [part for part in text.replace(";", ",").split(",") if part.strip()]
            given = {part: parse_assignment(part) for part in parts}
            factors = {one.name: one.number for one in given.values() if one.name in ("amplitude", "speed")}
            others = [part for part, one in given.items() if one.name not in factors]
            self.session.set_many(resolve_changes(table, self.session.values(), others), **factors)

        self._moved = None
        self._asked(change)

    def step(self, which: str) -> None:
        """Undo, redo, or go back to the file."""
        history = self.session.history
        act = {"Undo": history.undo, "Redo": history.redo}.get(which, self.session.back_to_file)
        self._moved = None
        self._asked(act)

    def _settle_later(self) -> None:
        if self._settling is not None:
            self._settling.cancel()
        self._settling = threading.Timer(SETTLED_S, self._settle)
        self._settling.daemon = True
        self._settling.start()

    def _settle(self) -> None:
        with self._lock:
            moved, self._moved = self._moved, None
            self.session.history.settle()
            if not self.session.stale and self.session.problem is None:
                self._follow()
        self.worker.ask("reach", lambda: self._reach(moved))

    # answering, in the worker's thread

    def _compute(self) -> None:
        self.session.compute()
        self._show()

    def _reach(self, moved: str | None) -> None:
        """Look how far sliders may go: the one that was moved; all lengths where closed forms answer quickly."""
        if self.session.stale:
            return
        quick = self.session.robot().closed_kinematics
        others = [knob.name for knob in self.session.knobs if knob.unit == "m" and not knob.part and quick]
        for name in dict.fromkeys([*([moved] if moved else []), *others]):
            reach = self.session.reach(name, lambda: self.worker.waiting)
            if self.worker.waiting:
                return
            self.knobs.show_reach(name, reach)

    def _compare(self, against: str) -> None:
        self.session.against = against
        self.worker.ask("show", self._show)

    def _show(self) -> None:
        """Show what was computed last."""
        session = self.session
        other = session.baseline()
        with self._lock, self.server.atomic():
            good = session.good
            self.sample = min(self.sample, len(good.t) - 1)
            if self._time.max != max(len(good.t) - 1, 1):
                self._time.max = max(len(good.t) - 1, 1)
            self.scene.show(good, other)
            self.scene.pose(self.sample)
            self.curves.show(good, other, str(self._quantity.value), words.against_words(session), self._plots)
            self._key.content = self.curves.key()
            self.curves.mark(self.sample)
            self._head.content = words.head(session)
            self._verdict.content = words.verdict(session)
            self._peaks.content = words.peaks(session, other)
            self._poses.content = words.pose_facts(session)
            self._moment.content = words.moment(good, self.sample)
            self._follow()
            self.pointing.follow()

    def _follow(self) -> None:
        """Put all inputs where the session is."""
        session, wanted = self.session, self.session.wanted
        if session.problem is None:
            self.knobs.follow(session.values(), self._moved)
        self.hands.put([
            (self._case, wanted.case), (self._amplitude, wanted.amplitude), (self._fast, wanted.speed),
            *((box, index in wanted.rows) for index, box in enumerate(self._held)),
        ])  # fmt: skip

    def _fault(self, error: BaseException) -> None:
        self.session.problem = f"a fault of the studio itself, {type(error).__name__}: {error}"
        self._head.content = words.head(self.session)

    # time

    def play(self, on: bool) -> None:
        """Play the motion in its own time, times the pace; or pause it."""
        self._playing = on
        self._play_button.label = "Pause" if on else "Play"
        if not on:
            self.at(self.sample)

    def toggle(self) -> None:
        """Play, or pause."""
        self.play(not self._playing)

    def worst(self) -> None:
        """Go to the moment at which a torque is at its peak."""
        self.play(False)
        self.at(self.session.good.worst_moment())

    def at(self, sample: int) -> None:
        """Draw a moment of the motion."""
        with self._lock:
            self.sample = max(0, min(sample, len(self.session.good.t) - 1))
            self.scene.pose(self.sample)
            self.curves.mark(self.sample)
            self._moment.content = words.moment(self.session.good, self.sample)
            self._put_time()

    def _grabbed(self, sample: int) -> None:
        self.play(False)
        self.at(int(sample))

    def _put_time(self) -> None:
        self.hands.put([(self._time, self.sample)])

    def _play(self) -> None:
        last = marked = time.monotonic()
        moment = 0.0
        while not self._ended.wait(1 / FRAMES_PER_S):
            now = time.monotonic()
            passed, last = now - last, now
            if not self._playing:
                moment = float(self.session.good.t[min(self.sample, len(self.session.good.t) - 1)])
                continue
            with self._lock:
                t = self.session.good.t
                moment += passed * self._speed
                if moment > t[-1]:  # over and over; where a busy machine lets more than a whole motion pass, too
                    moment = float(t[0] + (moment - t[0]) % max(t[-1] - t[0], 1e-9))
                self.sample = min(int(t.searchsorted(moment)), len(t) - 1)
                self.scene.pose(self.sample)
                if now - marked > 1 / MARKS_PER_S:
                    marked = now
                    self._put_time()
                    self._moment.content = words.moment(self.session.good, self.sample)
                    self.curves.mark(self.sample)

    # looks

    def _switched(self, mark: str, on: bool) -> None:
        with self._lock:
            self.scene.switch(mark, bool(on))
            self.scene.pose(self.sample)

    def _darken(self, dark: bool) -> None:
        self._dark = dark
        self._theme()
        self.curves.in_the(dark)
        with self._lock:
            self.scene.in_the(dark)
        self.worker.ask("show", self._show)

    # files

    def read_again(self) -> None:
        """Read the files again, in the worker's thread; a broken one is said, and the last good state kept."""
        self.worker.ask("read", self._read_again)

    def _read_again(self) -> None:
        with self._lock:  # what a hand asks for meanwhile is asked of the robot that was read
            if self.session.read_again() is not None:
                self._head.content = words.head(self.session)
                return
            self.knobs.build()
        self._show()

    def idle(self, timeout: float) -> bool:
        """Wait until all that was done by hand is answered; false where a part takes longer than *timeout* seconds."""
        return self.hands.idle(timeout) and self.worker.idle(timeout)

    def end(self) -> None:
        """Stop all threads of the page."""
        self._ended.set()
        if self._settling is not None:
            self._settling.cancel()
        self.hands.end()
        self.worker.end()
        self._player.join(timeout=2.0)
