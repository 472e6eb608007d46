"""What a study's files and columns are called: all of them that a report has to know, and nothing that computes."""

from __future__ import annotations

CONTROL = "control.json"
RUNS = "runs.parquet"
ERRORS = "errors.parquet"

LOOP_COLUMNS = ("case", "controller", "model", "speed", "rate", "rate_asked", "bandwidth")
ERROR_COLUMNS = (
    "joint", "rms", "peak", "rms_halved", "rms_second", "effort", "largest", "saturated",
)  # fmt: skip
"""What a row of a run holds; see docs/control.md."""

ROUTES = ("rms", "rms_halved", "rms_second")
"""Columns of an error: by the plant's step, by half of it, by MuJoCo's route."""

TRACKING = "tracking.json"
"""Beside the pictures of a film: what it shows."""

NOT_RUN = "not run"
"""In place of a verdict or a status: nobody computed it."""
