"""Run the campaigns of the library and keep what they found: examples/library.json and docs/library.md.

.venv/bin/python benchmarks/library.py            all robots
.venv/bin/python benchmarks/library.py rrr delta  these; the others keep their figures
.venv/bin/python benchmarks/library.py --page     the page alone, from the figures there are
"""

from __future__ import annotations

import sys
from pathlib import Path

from workbench.campaign.evidence import Effort
from workbench.commands.run_library import keep, run_library


def main() -> int:
    if sys.argv[1:] == ["--page"]:
        keep({})
        return 0
    names, out = sys.argv[1:] or ["all"], Path("build") / "library"
    effort = Effort(("mujoco", "pinocchio"))
    return run_library(names, out, effort, ["benchmarks/library.py", *names], replace=True, record=True)


if __name__ == "__main__":
    sys.exit(main())
