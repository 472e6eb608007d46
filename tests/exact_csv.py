"""CSV files read back to the last digit, which pandas does by itself since 3.1 and only when asked before."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

ASKED = {} if tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1) else {"float_precision": "round_trip"}


def read_exact(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, **ASKED)
