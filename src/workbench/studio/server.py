"""The studio's server: viser's, on this machine alone unless asked otherwise, for its own page alone.

viser serves whoever connects. A page of another site, open in the same browser, can connect to this machine, too: so
each request has to name the host that was asked for, and each WebSocket has to come from a page of this server. Beyond
loopback a random token is asked for besides.
"""

from __future__ import annotations

import http
import secrets
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from http.cookies import SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

import rich
import viser
import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from workbench.errors import OutputError

LOOPBACK = ("127.0.0.1", "localhost", "::1")
FIRST_PORT = 8765
TOKEN_BYTES = 24


@dataclass(frozen=True)
class Address:
    """Where a studio is found."""

    host: str
    port: int
    token: str
    """empty on loopback"""

    @property
    def url(self) -> str:
        """What is typed into a browser."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}/" + (f"?token={self.token}" if self.token else "")


class Guard:
    """Decides who is answered.

    Parameters
    ----------
    token
        What a foreign client has to know; empty: only this machine is answered, under its own names.
    """

    def __init__(self, token: str) -> None:
        self.token = token

    def refusal(self, path: str, headers: Any) -> str | None:
        """Why a request is refused; None where it is answered."""
        host = headers.get("Host", "")
        name = urlsplit(f"//{host}").hostname or ""
        if not self.token and name not in LOOPBACK:
            return f"this studio is at 127.0.0.1, not at {name}"
        origin = headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return "this studio answers its own page only"
        if self.token and not self._knows(path, headers):
            return "the address of this studio holds a token; open it as the terminal shows it"
        return None

    def _knows(self, path: str, headers: Any) -> bool:
        given = parse_qs(urlsplit(path).query).get("token", [""])[0]
        cookie: SimpleCookie = SimpleCookie()
        cookie.load(headers.get("Cookie", ""))
        kept = cookie["workbench"].value if "workbench" in cookie else ""
        return any(secrets.compare_digest(word.encode(), self.token.encode()) for word in (given, kept))

    def wrap(self, answer: Callable[[Any, Request], Response | None]) -> Callable[[Any, Request], Response | None]:
        """Put the guard before what answers requests; the token is kept as a cookie for the WebSocket."""

        def guarded(connection: Any, request: Request) -> Response | None:
            reason = self.refusal(request.path, request.headers)
            if reason is not None:
                body = f"workbench: {reason}\n".encode()
                headers = Headers({"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))})
                return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", headers, body)
            response = answer(connection, request)
            if response is not None:
                response.headers["Referrer-Policy"] = "no-referrer"
                response.headers["X-Frame-Options"] = "DENY"
                if self.token:
                    response.headers["Set-Cookie"] = f"workbench={self.token}; HttpOnly; SameSite=Strict; Path=/"
            return response

        return guarded


class StudioServer(viser.ViserServer):
    """viser's server without its tunnel: no client can ask for the scene to be shown on the internet."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Share nothing."""
        return None


@contextmanager
def _guarded(guard: Guard) -> Iterator[None]:
    """Let a server that is made meanwhile ask the guard first: viser offers no place for that."""
    serve = websockets.asyncio.server.serve

    def guarded(handler: Any, *arguments: Any, **options: Any) -> Any:
        return serve(handler, *arguments, **{**options, "process_request": guard.wrap(options["process_request"])})

    websockets.asyncio.server.serve = guarded  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]


def start_server(host: str = LOOPBACK[0], port: int = FIRST_PORT) -> tuple[StudioServer, Address]:
    """Start to serve an empty page, at *port* or the next one that is free.

    Raises
    ------
    OutputError
        The host is no address of this machine.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:  # viser would try a thousand ports, whatever is wrong
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.bind((host, 0))
    except OSError as error:
        raise OutputError(f"--host {host}: {error.strerror or error}; allowed: an address of this machine") from error
    token = "" if host in LOOPBACK else secrets.token_urlsafe(TOKEN_BYTES)
    rich.get_console().quiet = True  # viser prints its own banner; ours says more
    with _guarded(Guard(token)):
        server = StudioServer(host=host, port=port, verbose=False)
    return server, Address(host, server.get_port(), token)
