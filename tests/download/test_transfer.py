from __future__ import annotations

import gc
import socket

import pytest

from nacre.download.transfer import TRIES, Transfer, TransferError


@pytest.fixture
def transfer(tmp_path):
    return Transfer(tmp_path / ".file.part")


def left(folder):
    return sorted(path.name for path in folder.iterdir())


def test_whole_file_and_its_progress(server, content, transfer, tmp_path):
    reports = []
    transfer.progress = lambda *report: reports.append(report)
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content
    assert left(tmp_path) == [".file.part"]
    assert reports[-1] == (len(content), len(content))
    assert [done for done, _ in reports] == sorted(done for done, _ in reports)


def test_a_length_beyond_all_numbers_is_named_as_the_servers_fault(server, transfer, tmp_path):
    server.faults = [("length", "9" * 5000)]
    with pytest.raises(TransferError, match="invalid answer"):
        transfer(server.url)
    assert not (tmp_path / ".file.part").exists()


@pytest.mark.parametrize("validator", ["tag", "date"])
def test_goes_on_where_the_connection_broke_off(server, content, transfer, tmp_path, validator):
    server.tag, server.date = '"first"', "Wed, 01 Feb 2006 00:00:00 GMT"
    if validator == "date":
        server.tag = 'W/"weak tags do not identify bytes"'
    server.faults = [("cut", 2**17 + 5), ("cut", 2**16)]
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content
    asked = [headers.get("Range") for _, headers in server.requests]
    assert asked == [None, "bytes=131072-", "bytes=196608-"]
    condition = server.tag if validator == "tag" else server.date
    assert [h.get("If-Range") for _, h in server.requests] == [None, condition, condition]


def test_a_line_that_keeps_breaking_off(server, transfer, tmp_path):
    server.faults = [("cut", 10)] * TRIES
    with pytest.raises(TransferError, match=r"gave up after 5 tries: the connection broke off$"):
        transfer(server.url)


def test_goes_on_in_a_later_run(server, content, transfer, tmp_path):
    server.faults = [("cut", 70_000)] + [503] * (TRIES - 1)
    with pytest.raises(TransferError, match=r"gave up .* 503 .* 65,536 bytes are kept"):
        transfer(server.url)
    assert left(tmp_path) == [".file.part", ".file.part.json"]
    Transfer(transfer.part)(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content
    assert server.requests[-1][1]["Range"] == "bytes=65536-"


def test_starts_anew_where_ranges_are_not_served(server, content, transfer, tmp_path):
    server.ranges = False
    server.faults = [("cut", 100_000)]
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content


def test_starts_anew_where_nothing_identifies_the_content(server, content, transfer, tmp_path):
    server.tag = None
    server.faults = [("cut", 100_000)]
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content
    assert "Range" not in server.requests[1][1]


@pytest.mark.parametrize("conditions", [True, False])
def test_never_joins_two_versions(server, content, transfer, tmp_path, conditions):
    server.conditions = conditions  # False: a server that overlooks If-Range
    server.faults = [("cut", 100_000)] + [503] * (TRIES - 1)
    with pytest.raises(TransferError):
        transfer(server.url)
    server.content, server.tag = content[::-1], '"second"'
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content[::-1]


def test_parts_from_elsewhere_are_not_gone_on_from(server, content, transfer, tmp_path):
    server.faults = [("cut", 100_000)] + [503] * (TRIES - 1)
    with pytest.raises(TransferError):
        transfer(server.url + "/one")
    transfer(server.url + "/two")
    assert (tmp_path / ".file.part").read_bytes() == content
    assert "Range" not in server.requests[-1][1]


def test_a_range_that_starts_elsewhere_is_not_used(server, content, transfer, tmp_path):
    server.faults = [("cut", 70_000), ("start", 2000)]
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content


def test_a_part_with_nothing_left_to_ask_for(server, content, transfer, tmp_path):
    server.faults = [("cut", 70_000)] + [503] * (TRIES - 1)
    with pytest.raises(TransferError):
        transfer(server.url)
    transfer.part.write_bytes(content)
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content


def test_length_that_the_server_does_not_tell(server, content, transfer, tmp_path):
    server.tells_length = False
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content


@pytest.mark.parametrize("told", [True, False])
def test_a_file_of_another_length_is_refused(server, content, tmp_path, told):
    server.tells_length = told
    transfer = Transfer(tmp_path / ".part", size=len(content) - 1)
    with pytest.raises(TransferError, match=r"expected 299,999$"):
        transfer(server.url)
    assert not (tmp_path / ".file.part").exists()


@pytest.mark.parametrize("told", [True, False])
def test_a_file_without_end_is_refused(server, tmp_path, told):
    server.tells_length = told
    with pytest.raises(TransferError, match=r"expected at most 70,000$"):
        Transfer(tmp_path / ".part", limit=70_000)(server.url)
    part = tmp_path / ".part"
    assert not part.exists() or part.stat().st_size <= 70_000


def test_a_short_file_is_tried_again_and_given_up(server, content, tmp_path):
    server.tells_length = False
    transfer = Transfer(tmp_path / ".part", size=len(content) + 1)
    with pytest.raises(TransferError, match=f"gave up after {TRIES} tries"):
        transfer(server.url)


def test_not_found_is_not_tried_again(server, transfer, tmp_path):
    server.faults = [404]
    with pytest.raises(TransferError, match=r"127\.0\.0\.1: 404 Not Found: http://127"):
        transfer(server.url)
    assert len(server.requests) == 1


def test_a_web_page_is_no_file(server, transfer, tmp_path):
    server.kind = "text/html; charset=utf-8"
    with pytest.raises(TransferError, match="is a web page, not a file"):
        transfer(server.url)
    assert left(tmp_path) == []


@pytest.mark.parametrize("status", [408, 429, 500, 503])
def test_a_server_in_trouble_is_tried_again(server, content, transfer, tmp_path, status):
    server.faults = [status, status]
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content


def test_a_server_that_hangs_up_is_tried_again(server, content, transfer, tmp_path, monkeypatch):
    server.faults = [("cut", 0)]
    transfer(server.url)
    assert (tmp_path / ".file.part").read_bytes() == content


def test_nobody_there(transfer, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as closed:
        port = closed.getsockname()[1]
    with pytest.raises(TransferError, match=r"^cannot reach 127\.0\.0\.1: Connection refused$"):
        transfer(f"http://127.0.0.1:{port}/x")
    gc.collect()  # a connection left open would warn now
    assert left(tmp_path) == []


def test_no_password_is_kept_or_shown(server, transfer, tmp_path):
    url = server.url.replace("//", "//user:secret@")
    server.faults = [("cut", 70_000), 404]
    with pytest.raises(TransferError) as caught:
        transfer(url)
    assert "secret" not in str(caught.value)
    assert "secret" not in (tmp_path / ".file.part.json").read_text()


@pytest.mark.parametrize(
    ("location", "problem"),
    [
        ("{server}/x", "Exceeded 30 redirects"),
        ("file:///etc/passwd", "No connection adapters"),
        ("http://127.0.0.1:99999/x", "Port out of range"),
    ],
)
def test_redirects_that_lead_nowhere_are_one_line(server, transfer, tmp_path, location, problem):
    server.location = location.format(server=server.url)
    with pytest.raises(TransferError, match=problem) as caught:
        transfer(server.url)
    assert "\n" not in str(caught.value)
    assert not left(tmp_path)
