"""A studio from its start to its end: its address, a second one, signals, edited files, and who is answered."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from small_campaign import Workbench
from talking_process import TalkingProcess

viser = pytest.importorskip("viser", reason="the extra studio is not installed")

from workbench.studio.server import Guard  # noqa: E402

DELTA = Path(__file__).resolve().parents[1] / "examples" / "delta"
PATIENCE = 120.0
"""Seconds for a start on a busy machine."""
PORT = 18765


class Studio(TalkingProcess):
    """A studio in a process of its own."""

    def __init__(self, *arguments: str, cwd: Path | None = None) -> None:
        super().__init__("studio", *arguments, cwd=cwd, patience=PATIENCE)
        self.said: list[str] = []

    def until(self, pattern: str) -> str:
        while True:
            line = self.line()
            self.said.append(line)
            if found := re.search(pattern, line):
                return found.group()

    @property
    def url(self) -> str:
        found = next((re.search(r"http://\S+", line) for line in self.said if "http://" in line), None)
        if found is None:
            return self.until(r"http://\S+")
        return found.group()


@pytest.fixture(scope="module")
def studio() -> Iterator[Studio]:
    with Studio(str(DELTA), "--port", str(PORT)) as one:
        one.until("Ctrl-C ends")
        yield one


def status(url: str, **headers: str) -> int:
    request = urllib.request.Request(url, headers={name.replace("_", "-"): value for name, value in headers.items()})
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_it_says_a_loopback_address_and_answers_there(studio: Studio) -> None:
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", studio.url)
    with urllib.request.urlopen(studio.url, timeout=PATIENCE) as page:
        assert b"<html" in page.read()
        assert page.headers["X-Frame-Options"] == "DENY"


def test_a_page_of_another_site_is_not_answered(studio: Studio) -> None:
    assert status(studio.url) == 200
    assert status(studio.url, Origin="http://evil.example") == 403
    # a name that an attacker's server lets stand for this machine
    assert status(studio.url, Host="evil.example") == 403


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_second_one_takes_another_port_and_a_signal_ends_it(studio: Studio, number: str) -> None:
    port = re.search(r":(\d+)/", studio.url)
    assert port
    with Studio(str(DELTA), "--port", port.group(1)) as other:
        other.until("Ctrl-C ends")
        assert other.url != studio.url
        assert status(other.url) == 200
        os.kill(other.process.pid, getattr(signal, number))
        code = other.process.wait(timeout=PATIENCE)
        assert code == {"SIGINT": 0, "SIGTERM": 143, "SIGHUP": 129}[number]
        with pytest.raises(urllib.error.URLError):
            status(other.url)
    said = "".join(other.said)
    assert "viser" not in said
    assert "Traceback" not in said


def test_the_guard_of_a_foreign_host_asks_for_the_token() -> None:
    guard = Guard("secret-token")
    host = {"Host": "192.0.2.7:8765"}
    assert guard.refusal("/", host)
    assert guard.refusal("/?token=wrong", host)
    assert guard.refusal("/?token=", host)
    assert guard.refusal("/?token=secret-token", host) is None
    assert guard.refusal("/", {**host, "Cookie": "other=1; workbench=secret-token"}) is None
    assert guard.refusal("/", {**host, "Cookie": "workbench=secret-tokem"})
    assert guard.refusal("/?token=secret-token", {**host, "Origin": "http://evil.example"})
    assert guard.refusal("/?token=secret-token", {**host, "Origin": "http://192.0.2.7:8765"}) is None


def test_the_guard_of_loopback_answers_this_machine_alone() -> None:
    guard = Guard("")
    for host in ("127.0.0.1:8765", "localhost:8765", "[::1]:8765"):
        assert guard.refusal("/", {"Host": host}) is None
        assert guard.refusal("/", {"Host": host, "Origin": f"http://{host}"}) is None
        assert guard.refusal("/", {"Host": host, "Origin": "http://127.0.0.1:9"})
    assert guard.refusal("/", {"Host": "evil.example"})
    assert guard.refusal("/", {})


def test_every_address_has_to_be_asked_for_and_gets_a_token() -> None:
    with Studio(str(DELTA), "--host", "0.0.0.0", "--port", str(PORT + 50)) as one:
        one.until("Ctrl-C ends")
        url = one.url.replace("0.0.0.0", "127.0.0.1")
        assert re.search(r"\?token=[\w-]{32}$", url)
        assert status(url) == 200
        assert status(url.partition("?")[0]) == 403
        assert status(url[:-1] + ("A" if url[-1] != "A" else "B")) == 403


def run(*arguments: str, code: str = "pass") -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", f"import sys; {code}; from workbench.cli import main; main()", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)


def test_a_missing_extra_is_one_line_with_the_way_on() -> None:
    done = run("studio", str(DELTA), code="sys.modules['viser'] = None")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "pip install 'parallel-robot-workbench[studio]'" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("no_such_robot",), "no_such_robot"),
        ((str(DELTA), "--case", "slwo"), 'did you mean "slow"'),
        ((str(DELTA), "--set", "mp=-1"), "mp"),
        ((str(DELTA), "--host", "203.0.113.9"), "address of this machine"),
    ],
)
def test_bad_input_is_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    said: str,
) -> None:
    done = Workbench(tmp_path, monkeypatch, capsys)("studio", *arguments)
    assert done.code == 2
    assert said in done.err
    assert len(done.complaint) == 1
    assert done.out == ""


def test_help_loads_no_viser() -> None:
    done = run("studio", "--help", code="sys.modules['viser'] = None")
    assert done.returncode == 0
    assert "ROBOT | CAMPAIGN | RUN" in done.stdout
