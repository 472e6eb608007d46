"""The page without a browser: what is moved on it arrives in the session, and what is computed is written on it."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("viser", reason="the extra studio is not installed")

from viser import GuiEvent

from workbench.studio.curves import COORDINATE, ERROR, POWER, TORQUE, curves_of
from workbench.studio.page import Page
from workbench.studio.scene import MARKS, bounds, flat_axis
from workbench.studio.server import start_server
from workbench.studio.session import Session
from workbench.studio.solid_meshes import triangles
from workbench.studio.subject import Subject, open_subject
from workbench.studio.worker import Worker

REPOSITORY = Path(__file__).resolve().parents[1]
PATIENCE = 120.0


@pytest.fixture(scope="module")
def paper() -> Subject:
    return open_subject("asym_2rss_ppap")


@pytest.fixture
def page(paper: Subject) -> Iterator[Page]:
    server, _ = start_server(port=18800)
    made = Page(server, Session(paper, "pick_and_place"))
    yield made
    made.end()
    server.stop()


def idle(page: Page) -> None:
    assert page.idle(PATIENCE)


def by_hand(page: Page, handle: Any, value: Any) -> None:
    """What viser does when a browser says that an input was moved."""

    async def arrives() -> None:
        handle._impl.value = value
        for told in handle._impl.update_cb:
            await told(GuiEvent(None, 1, handle))

    asyncio.run_coroutine_threadsafe(arrives(), page.server.get_event_loop()).result(PATIENCE)


def test_a_moved_slider_arrives_and_its_answer_is_written(page: Page) -> None:
    idle(page)
    assert "nothing was changed here" in page._head.content
    slider = page.knobs._sliders["m3"]
    by_hand(page, slider, 0.6)
    idle(page)
    assert page.session.values()["m3"] == 0.6
    assert "m3 from 0.45 to 0.6 kg" in page._head.content
    assert "claims are not about this robot" in page._head.content
    assert "<th>file</th><th>change</th>" in page._peaks.content
    page.step("Undo")
    idle(page)
    assert slider.value == 0.45
    assert "nothing was changed here" in page._head.content
    page.step("Redo")
    idle(page)
    assert slider.value == 0.6
    page.step("Back to the paper")
    idle(page)
    assert slider.value == 0.45


def test_what_a_hand_gives_outlives_what_the_page_puts_there_meanwhile(page: Page) -> None:
    idle(page)
    slider, gate = page.knobs._sliders["m3"], threading.Event()
    page.hands.do(lambda: gate.wait(PATIENCE))  # the page is slow
    for value in (0.5, 0.55, 0.6):
        by_hand(page, slider, value)
    page._moved = None
    page._follow()  # what was computed before is shown, and the sliders go with it
    assert slider.value == 0.6
    gate.set()
    idle(page)
    page._follow()
    assert page.session.values()["m3"] == slider.value == 0.6
    page.step("Undo")  # one gesture, one step
    idle(page)
    assert slider.value == 0.45


def test_the_ends_of_a_slider_stay_under_the_hand(page: Page) -> None:
    idle(page)
    own, other = page.knobs._sliders["a1"], page.knobs._sliders["a2"]
    reach, narrow = (own.min, own.max), (other.min, other.max)
    low = page.session.knob("a1").low, page.session.knob("a2").low
    assert own.min > low[0]
    assert other.min > low[1]
    by_hand(page, own, 0.21)
    assert page.hands.idle(PATIENCE)
    assert (own.min, own.max) == reach
    assert (other.min, other.max) != narrow
    idle(page)
    assert (own.min, own.max) == reach


def test_what_is_typed_may_lie_beyond_the_sliders_and_what_is_wrong_is_said(page: Page) -> None:
    page._type("m3=3.0, m2*=0.5")
    idle(page)
    assert page.session.values()["m3"] == 3.0
    assert page.knobs._sliders["m3"].max == 3.0
    assert page.session.values()["m2_left"] == 0.15
    page._type("m4=nonsense")
    assert "is not a finite number" in page._head.content
    page._type("a2=0.16")
    idle(page)
    assert "out of reach" in page._head.content
    assert "last state that works" in page._head.content
    page.step("Undo")
    idle(page)
    assert "Not shown" not in page._head.content


def test_case_motion_and_formulas_are_chosen(page: Page) -> None:
    by_hand(page, page._case, "simulation_2")
    idle(page)
    assert page.session.good.state.case == "simulation_2"
    by_hand(page, page._fast, 0.5)
    idle(page)
    assert "motion 0.5 times as fast" in page._head.content
    for box in page._held:
        by_hand(page, box, False)
    idle(page)
    assert "No formula is held" in page._verdict.content
    by_hand(page, page._quantity, ERROR)
    idle(page)
    assert "No formula is held" in page._key.content


def test_time_runs_and_stops_at_the_worst_moment(page: Page) -> None:
    page.play(True)
    moved = threading.Event()
    for _ in range(int(PATIENCE / 0.05)):
        if page.sample > 0:
            break
        moved.wait(0.05)
    assert page.sample > 0
    page.worst()
    assert not page._playing
    assert page.sample == page.session.good.worst_moment() == page._time.value
    by_hand(page, page._time, 7)
    idle(page)
    assert page.sample == 7


def test_marks_slice_and_target(page: Page) -> None:
    for mark in MARKS:
        page.scene.switch(mark, True)
    page.at(3)
    by_hand(page, page.pointing._plane, "y z")
    idle(page)
    assert "cells of" in page.pointing._said.content
    by_hand(page, page.pointing._drag, True)
    idle(page)
    start = np.asarray(page.pointing._grip.position)
    origin, rotation = page.pointing._frame()
    page.pointing._grip.position = start + np.array([0.0, 0.01, 0.01])
    page.pointing._to(origin, rotation)
    assert "In reach" in page.pointing._said.content
    page.pointing._grip.position = start + np.array([0.0, 0.0, -9.0])
    page.pointing._to(origin, rotation)
    assert "Out of reach" in page.pointing._said.content


def test_the_keep_tab_gives_texts(page: Page) -> None:
    page._type("m3=0.6")
    idle(page)
    for make, said in (
        (page.keep._case, "[case.parameters]"),
        (page.keep._diff, "workbench model set models/asym_2rss_ppap.xml"),
    ):
        page.keep.say("label", make())
        assert said in page.keep._said.content


def test_nobody_can_ask_for_the_page_to_be_shared(page: Page) -> None:
    assert page.server.request_share_url() is None


@pytest.mark.parametrize("robot", ["asym_2rss_ppap", "planar_4rprp", str(REPOSITORY / "examples" / "fivebar")])
def test_curves_and_solids_of_any_robot(robot: str) -> None:
    session = Session(open_subject(robot))
    outcome = session.good
    for quantity in (TORQUE, ERROR, POWER, COORDINATE):
        for joint in range(len(outcome.case.robot.joints)):
            for curve in curves_of(outcome, outcome, quantity, joint, "file"):
                assert curve.values.shape == outcome.t.shape
    for solid in outcome.solids:
        vertices, faces = triangles(solid)
        assert faces.max() < len(vertices)
        if solid.kind == "capsule":
            np.testing.assert_allclose(vertices.max(axis=0)[2], solid.size[0] + solid.size[1], rtol=0.02)
            np.testing.assert_allclose(vertices.min(axis=0)[2], -vertices.max(axis=0)[2], rtol=1e-6)
    low, high = bounds(outcome.movement)
    assert (high > low).any()
    assert (flat_axis(outcome.movement) is not None) == ("fivebar" in robot)


def test_a_worker_does_the_last_of_many_and_outlives_a_fault() -> None:
    faults: list[BaseException] = []
    worker = Worker(faults.append)
    gate, done = threading.Event(), []
    worker.ask("first", lambda: gate.wait(PATIENCE) and None)
    for number in range(5):
        worker.ask("job", lambda number=number: done.append(number))
    worker.ask("fault", lambda: 1 / 0)
    gate.set()
    assert worker.idle(PATIENCE)
    assert done == [4]
    assert [type(fault) for fault in faults] == [ZeroDivisionError]
    worker.end()
