"""How long a studio takes from letting go of a slider to new numbers, without a browser: 200 samples, on this machine.

    python benchmarks/studio.py [ROBOT | CAMPAIGN ...] [--candidates FILE]

Each change is another value, so nothing is kept from an earlier one. Seconds of the clock and of the processor: on a
busy machine the first says how busy it is.
"""

from __future__ import annotations

import argparse
import statistics
import time

from workbench.studio import words
from workbench.studio.curves import TORQUE, curves_of
from workbench.studio.session import Session
from workbench.studio.subject import open_subject

ALLOWED_MS = 200.0
CHANGES = 15
FACTOR = 1.001
"""Of a parameter, change after change: small, so that every motion stays in reach."""


def changed(session: Session, name: str, start: float) -> tuple[float, float]:
    """Change one parameter again and again; median milliseconds by the clock and of the processor."""
    clocks, busy = [], []
    for number in range(1, CHANGES + 1):
        clock, processor = time.perf_counter(), time.process_time()
        session.set(name, start * FACTOR**number, gesture=name)
        outcome = session.compute()
        assert outcome is not None, session.problem
        other = session.baseline()
        for joint in range(len(outcome.case.robot.joints)):
            curves_of(outcome, other, TORQUE, joint, "file")
        _ = words.head(session), words.verdict(session), words.peaks(session, other), words.pose_facts(session)
        clocks.append(1e3 * (time.perf_counter() - clock))
        busy.append(1e3 * (time.process_time() - processor))
    return statistics.median(clocks), statistics.median(busy)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", nargs="*", default=["asym_2rss_ppap", "planar_4rprp"])
    parser.add_argument("--candidates", action="append", default=[])
    arguments = parser.parse_args()
    print(
        f"{'robot':24s} {'parameter':>10s} {'samples':>8s} {'clock ms':>9s} {'processor ms':>13s}  <= {ALLOWED_MS:g} ms"
    )
    for what in arguments.what:
        session = Session(open_subject(what, candidates=arguments.candidates))
        knobs = [k for k in session.knobs if k.settable and not k.part and k.value(session.values()) > 0]
        lengths = [k for k in knobs if k.unit == "m"][:1]
        masses = [k for k in knobs if k.unit == "kg"][:1]
        for knob in [*masses, *lengths]:
            session.compute()
            session.baseline()  # what is compared with is computed once
            clock, busy = changed(session, knob.name, knob.value(session.values()))
            verdict = "yes" if clock <= ALLOWED_MS else "no"
            name = session.subject.base.name
            print(f"{name:24s} {knob.name:>10s} {len(session.good.t):8d} {clock:9.0f} {busy:13.0f}  {verdict}")
            session.back_to_file()


if __name__ == "__main__":
    main()
