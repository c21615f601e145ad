"""The server of a page: one path, its own names, no file."""

from __future__ import annotations

import http.client
import threading
from collections.abc import Iterator

import pytest

from nacre.viewer.server import PageServer
from tests.tiers import tiered


@pytest.fixture
def server() -> Iterator[PageServer]:
    with PageServer(b"<!doctype html>page") as made:
        thread = threading.Thread(target=made.serve_forever, daemon=True)
        thread.start()
        yield made
        made.shutdown()
        thread.join()


def ask(
    server: PageServer, path: str = "/", method: str = "GET", host: str | None = None
) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=60)
    try:
        connection.putrequest(method, path, skip_host=True)
        if host != "":
            connection.putheader("Host", host or f"127.0.0.1:{server.server_port}")
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


def test_the_page_is_served_at_both_names(server: PageServer) -> None:
    assert ask(server) == (200, b"<!doctype html>page")
    assert ask(server, host=f"localhost:{server.server_port}")[0] == 200
    assert ask(server, method="HEAD") == (200, b"")


@pytest.mark.parametrize(
    "path",
    tiered(
        ["/../etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd", "/page.html", "/?a", "*"],
        ["/../etc/passwd", "/page.html"],
    ),
)
def test_nothing_else_is_served(server: PageServer, path: str) -> None:
    status, body = ask(server, path)
    assert status == 404
    assert b"root:" not in body


@pytest.mark.parametrize(
    "host",
    tiered(["evil.example", "evil.example:80", "127.0.0.1", "localhost", ""], ["evil.example"]),
)
def test_foreign_hosts_are_refused(server: PageServer, host: str) -> None:
    assert ask(server, host=host)[0] == 403


@pytest.mark.parametrize("method", tiered(["POST", "PUT", "DELETE", "OPTIONS"], ["POST"]))
def test_other_methods_are_refused(server: PageServer, method: str) -> None:
    assert ask(server, method=method)[0] == 501


def test_it_listens_on_loopback_alone(server: PageServer) -> None:
    assert server.server_address[0] == "127.0.0.1"
