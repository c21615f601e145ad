"""Serves a page on this machine's loopback address while a command runs."""

from __future__ import annotations

from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

_ADDRESS = "127.0.0.1"
_SECONDS = 10.0  # how long a browser may take to ask
_HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class PageServer(ThreadingHTTPServer):
    """Serves one page from memory and nothing else; no request reaches a file.

    Requests that name another host are refused, so that a foreign page whose name resolves to this
    machine (DNS rebinding) learns nothing. The page is UTF-8; port 0 takes any free one, and
    :class:`OSError` is raised if another is taken.
    """

    daemon_threads = True
    allow_reuse_address = False

    def __init__(self, page: bytes, port: int = 0) -> None:
        super().__init__((_ADDRESS, port), _Handler)
        self.page = page

    @property
    def url(self) -> str:
        return f"http://{_ADDRESS}:{self.server_port}/"

    @property
    def hosts(self) -> tuple[str, ...]:
        """The names by which a request may call this server."""
        return tuple(f"{name}:{self.server_port}" for name in (_ADDRESS, "localhost"))

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore browsers that hang up."""


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    timeout = _SECONDS

    def do_GET(self) -> None:
        self._answer(body=True)

    def do_HEAD(self) -> None:
        self._answer(body=False)

    def _answer(self, *, body: bool) -> None:
        if self.headers.get_all("Host") not in [[host] for host in self.server.hosts]:
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        if self.path != "/":
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        self.send_response(HTTPStatus.OK)
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(self.server.page)))
        self.end_headers()
        if body:
            self.wfile.write(self.server.page)

    def version_string(self) -> str:
        return "nacre"

    def log_message(self, *args: Any) -> None:
        """Log nothing: the command's output is not for requests."""
