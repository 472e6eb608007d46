"""Compare two results of `make bench`: `python benchmarks/compare.py A.json B.json`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

NOTABLE = 0.1
"""Changes below this fraction are noise on most machines."""


def load(path: str) -> dict:
    """Read one result; refuse what is none."""
    try:
        content = json.loads(Path(path).read_text())
        if content["format"] != 1:
            raise SystemExit(f"{path}: format {content['format']}; this program reads format 1")
        return content
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SystemExit(f"{path}: no benchmark result ({error})") from error


def rows(content: dict, kind: str, value: str) -> dict[tuple, float]:
    """Values by what was measured."""
    return {(row["robot"], row["what"], row.get("batch", "")): row[value] for row in content[kind]}


def main() -> int:
    """Print both tables side by side."""
    if len(sys.argv) != 3:
        raise SystemExit("usage: python benchmarks/compare.py A.json B.json")
    one, two = load(sys.argv[1]), load(sys.argv[2])
    for key in ("cpu", "cores", "python", "packages"):
        if one["machine"][key] != two["machine"][key]:
            print(f"{key}: {one['machine'][key]} and {two['machine'][key]}: times cannot be compared, ratios can")
    for kind, value, title in (("ratios", "value", "ratio"), ("times", "median_us", "us per sample")):
        a, b = rows(one, kind, value), rows(two, kind, value)
        print(f"\n{'robot':16} {title:64} {'batch':>9} {'A':>10} {'B':>10} {'B : A':>8}")
        for key in {**a, **b}:
            robot, what, batch = key
            left, right = a.get(key), b.get(key)
            shown = [f"{v:10.4g}" if v is not None else f"{'missing':>10}" for v in (left, right)]
            quotient = right / left if left and right else None
            mark = "" if quotient is None else f"{quotient:8.3f}{' *' if abs(quotient - 1) > NOTABLE else ''}"
            print(f"{robot:16} {what:64} {batch:>9} {shown[0]} {shown[1]} {mark}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
