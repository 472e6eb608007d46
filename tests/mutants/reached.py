"""Which tests reach which lines, and how much of the processor they take: one run of the core tests without a fault."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest


class Timed:
    """A pytest plugin: what each test takes of the processor and which fail, written as JSON at the end."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.durations: dict[str, float] = {}
        self.failed: list[str] = []

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Any:
        start = time.process_time()
        try:
            return (yield)
        finally:
            self.durations[item.nodeid] = time.process_time() - start

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_sessionfinish(self) -> None:
        self.out.write_text(json.dumps({"durations": self.durations, "failed": self.failed}), encoding="utf-8")


class Reached(Timed):
    """The same, and coverage with the running test as context."""

    def __init__(self, package: Path, out: Path) -> None:
        from coverage import Coverage

        super().__init__(out)
        self.package = package
        self.coverage = Coverage(data_file=None, config_file=False, source=[str(package)], messages=False)

    def pytest_sessionstart(self) -> None:
        self.coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Any:
        self.coverage.switch_context(item.nodeid)
        try:
            return (yield from super().pytest_runtest_protocol(item))
        finally:
            self.coverage.switch_context("")

    def pytest_sessionfinish(self) -> None:
        self.coverage.stop()
        data = self.coverage.get_data()
        lines: dict[str, dict[str, list[str]]] = {}
        for path in data.measured_files():
            by_line = data.contexts_by_lineno(path)
            name = Path(path).relative_to(self.package).as_posix()
            lines[name] = {str(line): sorted(tests) for line, tests in by_line.items()}
        tests = {"lines": lines, "durations": self.durations, "failed": self.failed}
        self.out.write_text(json.dumps(tests), encoding="utf-8")
