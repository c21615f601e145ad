"""A web server on loopback whose faults a test can order."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

_PIECE = 1 << 16


class Server(ThreadingHTTPServer):
    """Serves `content` at every path.

    `faults` are used up one a request: a number is a status to answer with, `("cut", n)` closes
    the connection after n bytes, `("start", n)` answers a range with one that starts at n. What is
    sent comes in pieces, with `pause` seconds between them.
    """

    daemon_threads = True

    def __init__(self, content: bytes) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.content = content
        self.tag: str | None = '"first"'
        self.date: str | None = None
        self.kind = "application/octet-stream"
        self.ranges = True
        self.conditions = True
        self.tells_length = True
        self.location: str | None = None
        self.pause = 0.0
        self.faults: list[Any] = []
        self.requests: list[tuple[str, dict[str, str]]] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that goes away is no news."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: Server

    def log_message(self, *arguments: Any) -> None:
        pass

    def do_GET(self) -> None:
        server = self.server
        server.requests.append((self.path, dict(self.headers)))
        if server.location:
            self.send_response(302)
            self.send_header("Location", server.location)
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        fault = server.faults.pop(0) if server.faults else None
        if isinstance(fault, int):
            self.send_response(fault)
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        start = self._start()
        if start >= len(server.content) > 0:
            self.send_response(416)
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        if fault and fault[0] == "start":
            start = fault[1]
        size = len(server.content)
        self.send_response(206 if start else 200)
        if start:
            self.send_header("Content-Range", f"bytes {start}-{size - 1}/{size}")
        if server.tells_length:
            length = fault[1] if fault and fault[0] == "length" else str(size - start)
            self.send_header("Content-Length", length)
        else:
            self.close_connection = True
        headers = {"ETag": server.tag, "Last-Modified": server.date, "Content-Type": server.kind}
        for name, value in headers.items():
            if value:
                self.send_header(name, value)
        self.end_headers()
        end = start + fault[1] if fault and fault[0] == "cut" else None
        content = server.content[start:end]
        for place in range(0, len(content), _PIECE):
            self.wfile.write(content[place : place + _PIECE])
            time.sleep(server.pause)
        if end is not None:
            self.close_connection = True

    def _start(self) -> int:
        condition = self.headers.get("If-Range")
        if not self.server.ranges or "Range" not in self.headers:
            return 0
        if self.server.conditions and condition not in (None, self.server.tag, self.server.date):
            return 0
        return int(self.headers["Range"].removeprefix("bytes=").removesuffix("-"))


@contextmanager
def serving(content: bytes) -> Iterator[Server]:
    """A running server."""
    with Server(content) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()
