"""The server of the page: on the loopback address alone, and only for those who know its token."""

import json
import os
import socketserver
import sys
from collections.abc import Callable
from functools import cached_property
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from secrets import compare_digest, token_urlsafe
from typing import Any
from urllib.parse import parse_qsl

from hertzlink.explore.answers import Explorer
from hertzlink.explore.sliders import plain

HOME = "127.0.0.1"

MOST_FIELDS = 100
"""Values of a request."""

FAILURES = (ArithmeticError, RuntimeError, MemoryError)
"""Errors of runs whose values are allowed; the page shows their message."""

RULES = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class Server(ThreadingHTTPServer):
    """Serves the page of an explorer, and its answers.

    title: above the page. notes: sentences below it. port: 0 for a free one; an OSError for one that is taken.
    """

    daemon_threads = True
    # On Windows two programs could otherwise share a port.
    allow_reuse_address = os.name == "posix"

    def __init__(self, explorer: Explorer, title: str, notes: list[str], port: int = 0) -> None:
        super().__init__((HOME, port), Handler)
        self.explorer, self.title, self.notes, self.token = explorer, title, notes, token_urlsafe(24)
        port = self.server_address[1]
        self.hosts = (f"{HOME}:{port}", f"localhost:{port}")
        self.address = f"http://{HOME}:{port}/?token={self.token}"

    def server_bind(self) -> None:
        """Bind, without asking for the name of this computer, which may take seconds."""
        socketserver.TCPServer.server_bind(self)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore a browser that closes its page: this is no error."""
        if not isinstance(sys.exception(), ConnectionError | TimeoutError):
            super().handle_error(request, client_address)

    @cached_property
    def sliders(self) -> list[dict[str, Any]]:
        """The sliders, for the page."""
        return [
            {"name": s.name, "label": s.label, "unit": s.unit, "choices": list(s.choices), "whole": s.whole}
            | {name: plain(getattr(s, name)) for name in ("low", "high", "step")}
            | {"start": s.start if isinstance(s.start, str) else plain(s.start)}
            for s in self.explorer.sliders
        ]

    def page(self, nonce: str) -> str:
        """Return the page."""
        from jinja2 import Environment, StrictUndefined
        from markupsafe import Markup

        def part(package: str, name: str) -> Markup:
            return Markup((files(package) / name).read_text(encoding="utf-8"))

        style = part("hertzlink.reports", "report.css") + part("hertzlink.explore", "page.css")
        template = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
        return template.from_string(part("hertzlink.explore", "page.html.j2")).render(
            title=self.title, notes=self.notes, nonce=nonce, style=style, script=part("hertzlink.explore", "page.js"),
            sliders=self.sliders,
        )  # fmt: skip


class Handler(BaseHTTPRequestHandler):
    """Answers one request."""

    server: Server
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "hertzlink", ""
    timeout = 60
    # Head and body in one piece at once: otherwise the body waits 40 ms until the head is acknowledged.
    wbufsize, disable_nagle_algorithm = -1, True

    def do_GET(self) -> None:
        """Send the page, or an answer; nothing else is there, and no file is read for a request."""
        place, _, query = self.path.partition("?")
        try:
            pairs = parse_qsl(query, keep_blank_values=True, max_num_fields=MOST_FIELDS)
        except ValueError:
            return self._answer(400, {"error": "too many values"})
        given = dict(pairs)
        token = given.pop("token", "").encode()
        if self.headers.get("Host") not in self.server.hosts or not compare_digest(token, self.server.token.encode()):
            return self._send(403, "text/plain", "Open the address that hertzlink printed, with its token.\n")
        if place == "/":
            nonce = token_urlsafe(16)
            return self._send(200, "text/html", self.server.page(nonce), nonce)
        explorer = self.server.explorer
        if place in (answers := {"/answer": explorer.answer, "/sketch": explorer.sketch, "/case": explorer.text}):
            return self._run(answers[place], given)
        return self._send(404, "text/plain", "There is no such page.\n")

    def _run(self, answer: Callable[[dict[str, str]], dict[str, Any]], query: dict[str, str]) -> None:
        try:
            self._answer(200, answer(query))
        except ValueError as error:
            self._answer(400, {"error": " ".join(str(error).split())})
        except FAILURES as error:
            self._answer(422, {"error": f"the run failed: {' '.join(str(error).split()) or type(error).__name__}"})

    def _answer(self, code: int, data: dict[str, Any]) -> None:
        self._send(code, "application/json", json.dumps(data, ensure_ascii=False, allow_nan=False))

    def _send(self, code: int, kind: str, text: str, nonce: str = "") -> None:
        body = text.encode()
        source = f"'nonce-{nonce}'" if nonce else "'none'"
        policy = (
            f"default-src 'none'; script-src {source}; style-src {source}; connect-src 'self'; img-src data:; "
            "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        self.send_response(code)
        for name, value in RULES.items():
            self.send_header(name, value)
        self.send_header("Content-Security-Policy", policy)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing: the terminal stays quiet, and the token is nowhere else."""
