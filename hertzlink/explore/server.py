"""The server of the page: on the loopback address alone, and only for those who know its token."""

import json
import os
import socketserver
import sys
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from secrets import compare_digest, token_urlsafe
from typing import Any
from urllib.parse import parse_qsl

from hertzlink.explore.answers import Explorer
from hertzlink.reports import environment

HOME = "127.0.0.1"

POLICY = "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
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

    def server_bind(self) -> None:  # without asking for the name of this computer, which may take seconds
        socketserver.TCPServer.server_bind(self)

    def handle_error(self, request: Any, client_address: Any) -> None:  # a browser may close its page
        if not isinstance(sys.exception(), ConnectionError | TimeoutError):
            super().handle_error(request, client_address)

    def page(self, nonce: str) -> str:
        """Return the page. nonce: a word that only its own scripts and styles have."""
        sliders = [slider.for_page() for slider in self.explorer.sliders]
        template = environment().get_template("explore/page.html.j2")
        return template.render(title=self.title, notes=self.notes, nonce=nonce, sliders=sliders)


class Handler(BaseHTTPRequestHandler):
    """Answers one request. No file is read for it."""

    server: Server
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "hertzlink", ""
    timeout = 60
    # Head and body in one piece at once: otherwise the body waits 40 ms until the head is acknowledged.
    wbufsize, disable_nagle_algorithm = -1, True

    def do_GET(self) -> None:
        """Send the page, an answer, the sketch or the case."""
        place, _, query = self.path.partition("?")
        try:
            given = dict(parse_qsl(query, keep_blank_values=True, max_num_fields=100))
        except ValueError:
            return self.send_json(400, {"error": "too many values"})
        token = given.pop("token", "").encode()
        if self.headers.get("Host") not in self.server.hosts or not compare_digest(token, self.server.token.encode()):
            return self.send_text(403, "text/plain", "Open the address that hertzlink printed, with its token.\n")
        if place == "/":
            nonce = token_urlsafe(16)
            return self.send_text(200, "text/html", self.server.page(nonce), nonce)
        explorer = self.server.explorer
        answers: dict[str, Callable[[dict[str, str]], dict[str, Any]]] = {
            "/answer": explorer.answer,
            "/sketch": explorer.sketch,
            "/case": lambda values: {"case": explorer.changed(values).to_toml()},  # a file for `hertzlink run`
        }
        if place not in answers:
            return self.send_text(404, "text/plain", "There is no such page.\n")
        try:
            self.send_json(200, answers[place](given))
        except ValueError as error:
            self.send_json(400, {"error": " ".join(str(error).split())})
        except (ArithmeticError, RuntimeError, MemoryError) as error:  # of a run whose values are allowed
            words = " ".join(str(error).split()) or type(error).__name__
            self.send_json(422, {"error": f"the run failed: {words}"})

    def send_json(self, code: int, data: dict[str, Any]) -> None:
        self.send_text(code, "application/json", json.dumps(data, ensure_ascii=False, allow_nan=False))

    def send_text(self, code: int, kind: str, text: str, nonce: str = "") -> None:
        """Send text, with rules by which it loads nothing from elsewhere."""
        body, source = text.encode(), f"'nonce-{nonce}'" if nonce else "'none'"
        policy = f"default-src 'none'; script-src {source}; style-src {source}; {POLICY}"
        of_text = {"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(body))}
        self.send_response(code)
        for name, value in {**RULES, "Content-Security-Policy": policy, **of_text}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        pass  # the terminal stays quiet, and the token is nowhere else
