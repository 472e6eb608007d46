"""Run directories that somebody edited: entries of another type, missing, endless or deep; torn tables; no pictures."""

from __future__ import annotations

import io
import json
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from bad_inputs import HUGE, directory, fifo, itself
from judged_call import Bad, Content

JUNK: dict[str, Any] = {
    "null": None, "true": True, "minus one": -1, "text": "x", "a list in a list": [[]], "a table": {"a": 1}, "1e308": 1e308,
    "a long text": "x" * 3_000_000, "NUL": "\0", "surrogate": "\udc80", "markup": "</script><script>alert(1)</script>", "1e18": 10**18,
}  # fmt: skip
RAW = {
    "NaN": "NaN",
    "Infinity": "-Infinity",
    "5000 digits": HUGE,
    "deep": "[" * 50_000 + "]" * 50_000,
    "1e400": "1e400",
}
MARK = '"@@junk@@"'

Step = str | int


def places(data: Any, path: tuple[Step, ...] = ()) -> Iterator[tuple[Step, ...]]:
    """Every place in a JSON document, outer ones first."""
    if path:
        yield path
    inner = data.items() if isinstance(data, dict) else enumerate(data[:3]) if isinstance(data, list) else ()
    for key, value in inner:
        yield from places(value, (*path, key))


def changed(text: str, path: tuple[Step, ...], junk: str | None) -> str:
    """Put *junk*, JSON text, in a place; None takes the entry away."""
    data = json.loads(text)
    outer = data
    for step in path[:-1]:
        outer = outer[step]
    if junk is None:
        del outer[path[-1]]
    else:
        outer[path[-1]] = json.loads(MARK)
    return json.dumps(data).replace(MARK, junk or "")


def in_run(name: str, change: Callable[[bytes], bytes] | Content) -> Callable[[Path], object]:
    """Change a file of the run directory that lies beside, ``run``."""

    def apply(path: Path) -> None:
        place = path.parent / "run" / name
        before = place.read_bytes() if place.is_file() else b""
        if place.is_file():
            place.unlink()
        place.parent.mkdir(exist_ok=True)
        if isinstance(change, str):
            place.write_text(change, encoding="utf-8")
        elif isinstance(change, bytes):
            place.write_bytes(change)
        elif change in (fifo, directory, itself):
            change(place)  # type: ignore[arg-type]
        else:
            place.write_bytes(change(before))  # type: ignore[arg-type, operator]

    return apply


COMMANDS = (("report", "run"), ("compare", "good", "run"), ("compare", "run", "good"), ("status", "run"))


def documents(good: Path, file: str, count: int, seed: int) -> Iterator[Bad]:
    """Entries of a JSON document changed at random; what a reader does not look at may be anything."""
    text = (good / file).read_text(encoding="utf-8")
    choice = random.Random(seed)
    every = list(places(json.loads(text)))
    values: dict[str, str | None] = {name: json.dumps(value) for name, value in JUNK.items()} | RAW | {"gone": None}
    for _ in range(count):
        path, what = choice.choice(every), choice.choice(list(values))
        command = choice.choice(COMMANDS)
        new = changed(text, path, values[what])
        yield Bad(
            f"run: {file}: {'.'.join(map(str, path))} is {what}: {command[0]}",
            command,
            {"x": in_run(file, new)},
            "",
            (0, 1, 2),
        )


def tables(good: Path) -> Iterator[Bad]:
    text = (good / "summary.csv").read_text(encoding="utf-8")
    lines = text.splitlines(keepends=True)
    first = lines[1].split(",")

    def cell(number: int, new: str) -> str:
        return "".join([lines[0], ",".join([*first[:number], new, *first[number + 1 :]]), *lines[2:]])

    header = lines[0].strip().split(",")
    contents: dict[str, Content] = {
        "a pipe": fifo, "a directory": directory, "a link to itself": itself, "binary": bytes(range(256)), "empty": "", "UTF-16": text.encode("utf-16"),
        "twice a column": text.replace("rms_error", "peak_error", 1), "a column less": text.replace("rms_error", "nobody", 1), "a torn line": text[: len(text) - 25],
        "a field beyond the limit": cell(0, "x" * 200_000), "an unclosed quote": cell(0, '"x'), "a NUL": cell(0, "a\0b"), "60 MB": "x" * 60_000_000,
        "a stranger's case": cell(0, "nobody"), "a stranger's joint": cell(3, "nobody"), "half a million lines": text + lines[1] * 500_000,
    }  # fmt: skip
    for column in ("peak_error", "rms_error", "worst_time_s", "bound", "peak_reference", "pointwise_skipped"):
        for junk in ("x", HUGE, "1_0", "0x1", "--1"):
            contents[f"{column} {junk[:4]}"] = cell(header.index(column), junk)
    contents |= {
        f"pointwise_skipped {junk}": cell(header.index("pointwise_skipped"), junk)
        for junk in ("nan", "inf", "-1", "1.5", "1e300")
    }
    contents |= {
        f"{column} {junk}": cell(header.index(column), junk)
        for column, junk in (("bound", "inf"), ("bound", "-1"), ("peak_error", "-1"))
    }
    for what, content in contents.items():
        yield Bad(f"run: summary.csv: {what}", ("report", "run"), {"x": in_run("summary.csv", content)}, "summary.csv")


def one_bit(data: bytes) -> bytes:
    """Among the numbers of the first column."""
    column = pq.ParquetFile(io.BytesIO(data)).metadata.row_group(0).column(0)
    place = 4 + column.total_compressed_size // 2
    return data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :]


def other_files(good: Path) -> Iterator[Bad]:
    case = next((good / "series").iterdir()).name
    yield Bad("run: series: one bit changed", ("report", "run"), {"x": in_run(f"series/{case}", one_bit)}, case)
    for what, content in {"a pipe": fifo, "a directory": directory, "a link to itself": itself, "binary": bytes(range(256)), "empty": "",
                          "cut": lambda data: data[: len(data) // 2], "bytes changed": lambda data: data[:-200] + b"\x00" * 20 + data[-180:]}.items():  # fmt: skip
        # at its end a Parquet file says what is in it: of that some bytes matter and some do not
        codes = (0, 2) if what == "bytes changed" else (2,)
        yield Bad(f"run: series: {what}", ("report", "run"), {"x": in_run(f"series/{case}", content)}, case, codes)
        yield Bad(
            f"run: manifest.json: {what}", ("report", "run"), {"x": in_run("manifest.json", content)}, "manifest.json"
        )
        yield Bad(
            f"run: manifest.json: {what}: status", ("status", "run"), {"x": in_run("manifest.json", content)}, "run"
        )
        yield Bad(
            f"run: film: {what}",
            ("report", "run", "--format", "pdf"),
            {"x": in_run("pictures/film.webp", content)},
            "",
            (0, 2),
        )
        yield Bad(
            f"run: still: {what}",
            ("report", "run", "--format", "pdf"),
            {"x": in_run("pictures/mechanism.webp", content)},
            "",
            (0, 2),
        )
        yield Bad(
            f"run: pictures.json: {what}",
            ("report", "run"),
            {"x": in_run("pictures/pictures.json", content)},
            "pictures.json",
        )
    still = b"RIFF\0\0\0\0WEBP" + b"x" * 100
    yield Bad(
        "run: still: malformed",
        ("report", "run", "--format", "pdf"),
        {"x": in_run("pictures/mechanism.webp", still)},
        "mechanism.webp",
    )


def bad_runs(good: Path, count: int = 150) -> list[Bad]:
    return [
        *documents(good, "manifest.json", count, 14),
        *documents(good, "pictures/pictures.json", count // 8, 15),
        *tables(good),
        *other_files(good),
    ]
