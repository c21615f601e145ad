from __future__ import annotations

import dataclasses
import hashlib
import json
import multiprocessing
import os
import resource
import sys
import threading
from pathlib import Path

import platformdirs
import pytest

import nacre
from nacre.download import Database, Facts, cache_folder, fetch
from nacre.errors import NacreError
from nacre.io.outputs import overwrite
from tests.download.server import Server

TERMS = "Be kind.\n"


def accept(terms: str) -> bool:
    assert terms == TERMS
    return True


@pytest.fixture(autouse=True)
def anything_is_a_material(monkeypatch):
    monkeypatch.setattr(sys.modules[fetch.__module__], "load", lambda path: None)


@pytest.fixture
def database(server: Server, content: bytes) -> Database:
    facts = Facts(hashlib.sha256(content).hexdigest(), len(content))
    return Database(
        "shop",
        "things",
        ".bin",
        TERMS,
        "https://example.org/shop",
        {"known": facts, "unknown": Facts()},
        server.url + "/{name}/file.bin",
    )


def left(folder):
    return sorted(path.name for path in folder.iterdir())


def test_file_terms_and_record(database, server, content, tmp_path):
    found = fetch(database, "known", tmp_path / "new" / "folder", agree=accept)
    assert found.path == tmp_path / "new" / "folder" / "known.bin"
    assert found.path.read_bytes() == content
    assert (found.fresh, found.verified) == (True, True)
    assert left(found.path.parent) == ["known.bin", "known.bin.json", "shop-TERMS.txt"]
    assert (found.path.parent / "shop-TERMS.txt").read_text() == TERMS
    record = json.loads((found.path.parent / "known.bin.json").read_text())
    assert record.pop("downloaded").endswith("+00:00")
    assert record.pop("modified_ns") == found.path.stat().st_mtime_ns
    assert record == {
        "database": "shop",
        "material": "known",
        "url": f"{server.url}/known/file.bin",
        "bytes": len(content),
        "sha256": hashlib.sha256(content).hexdigest(),
        "verified": True,
    }


def test_a_second_run_needs_no_network(database, server, tmp_path):
    fetch(database, "known", tmp_path, agree=accept)
    fetch(database, "unknown", tmp_path, agree=accept)
    count = len(server.requests)
    away = dataclasses.replace(database, url=None)
    for material in ("known", "unknown"):
        found = fetch(away, material, tmp_path)
        assert not found.fresh
        assert found.verified == (material == "known")
    assert len(server.requests) == count


def test_a_file_put_there_by_hand_counts(database, content, tmp_path):
    (tmp_path / "known.bin").write_bytes(content)
    found = fetch(dataclasses.replace(database, url=None), "known", tmp_path)
    assert found.verified


def test_a_file_of_the_users_is_replaced_by_force_only(database, server, content, tmp_path):
    (tmp_path / "known.bin").write_bytes(content[:-1])
    with pytest.raises(
        NacreError, match=r"known\.bin: exists, and \.bin files do not say who .*--force"
    ):
        fetch(database, "known", tmp_path, agree=accept)
    assert (tmp_path / "known.bin").read_bytes() == content[:-1]
    assert not server.requests
    with overwrite():
        assert fetch(database, "known", tmp_path, agree=accept).fresh
    assert (tmp_path / "known.bin").read_bytes() == content


def test_a_damaged_download_is_replaced(database, content, tmp_path):
    path = fetch(database, "known", tmp_path, agree=accept).path
    status = path.stat()
    path.write_bytes(bytes(len(content)))
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert fetch(database, "known", tmp_path).fresh
    assert path.read_bytes() == content


def test_a_wrong_checksum_leaves_nothing(database, server, content, tmp_path):
    server.content = content[::-1]
    with pytest.raises(
        NacreError, match=r"known/file\.bin: .* does not have the SHA-256 [0-9a-f]{64};"
    ):
        fetch(database, "known", tmp_path, agree=accept)
    assert left(tmp_path) == ["shop-TERMS.txt"]
    server.content = content
    assert fetch(database, "known", tmp_path).fresh


def test_a_damaged_file_stays_until_it_can_be_replaced(database, server, content, tmp_path):
    (tmp_path / "known.bin").write_bytes(b"old")
    server.content = content[::-1]
    with overwrite(), pytest.raises(NacreError, match="SHA-256"):
        fetch(database, "known", tmp_path, agree=accept)
    assert (tmp_path / "known.bin").read_bytes() == b"old"


def test_without_a_known_checksum_the_first_one_counts(database, server, content, tmp_path):
    first = fetch(database, "unknown", tmp_path, agree=accept)
    assert not first.verified
    first.path.unlink()
    assert fetch(database, "unknown", tmp_path).sha256 == first.sha256
    first.path.unlink()
    server.content = content[::-1]
    with pytest.raises(NacreError, match=f"SHA-256 of the first download, {first.sha256}; .*json"):
        fetch(database, "unknown", tmp_path)
    assert not first.path.exists()
    (tmp_path / "unknown.bin.json").unlink()
    assert fetch(database, "unknown", tmp_path).path.read_bytes() == content[::-1]


def test_a_file_changed_on_disk_is_reported(database, tmp_path):
    path = fetch(database, "unknown", tmp_path, agree=accept).path
    path.write_bytes(b"edited")
    with pytest.raises(NacreError, match="is not the file that was downloaded"):
        fetch(database, "unknown", tmp_path)
    assert path.read_bytes() == b"edited"


def test_without_a_known_checksum_it_must_be_a_material(database, server, monkeypatch, tmp_path):
    monkeypatch.setattr(sys.modules[fetch.__module__], "load", nacre.load)
    for content, problem in (
        (b"<html>sold</html>\n", "/unknown/file.bin: is a web page, not the file; discarded; open"),
        (b"sold", "the file: .*discarded"),
    ):
        server.content = content
        with pytest.raises(NacreError, match=problem):
            fetch(database, "unknown", tmp_path, agree=accept)
    assert left(tmp_path) == ["shop-TERMS.txt"]


def test_terms_come_first(database, server, tmp_path):
    with pytest.raises(NacreError, match="shop: the terms of use are not accepted"):
        fetch(database, "known", tmp_path / "folder")
    assert not (tmp_path / "folder").exists()
    assert not server.requests
    fetch(database, "known", tmp_path / "folder", agree=accept)
    fetch(database, "unknown", tmp_path / "folder", agree=lambda terms: pytest.fail("asked again"))
    free = dataclasses.replace(database, free="no conditions")
    assert fetch(free, "known", tmp_path / "free").verified
    assert (tmp_path / "free" / "shop-TERMS.txt").read_text() == TERMS
    changed = dataclasses.replace(database, terms="Be kinder.\n")
    (tmp_path / "folder" / "known.bin").unlink()
    with pytest.raises(NacreError, match="not accepted"):
        fetch(changed, "known", tmp_path / "folder")


@pytest.mark.parametrize("by", ["argument", "environment"])
def test_mirror(database, server, content, tmp_path, monkeypatch, by):
    mirror = server.url + "/pub/"
    if by == "environment":
        monkeypatch.setenv("NACRE_MIRROR", mirror)
    given = mirror if by == "argument" else None
    nowhere = dataclasses.replace(database, url=None)
    assert fetch(nowhere, "known", tmp_path, given, accept).path.read_bytes() == content
    assert server.requests[0][0] == "/pub/shop/known.bin"


def test_cache_folder(database, tmp_path, monkeypatch):
    monkeypatch.setenv("NACRE_CACHE", str(tmp_path / "cache"))
    found = fetch(database, "known", agree=accept)
    assert found.path == tmp_path / "cache" / "shop" / "known.bin"
    monkeypatch.delenv("NACRE_CACHE")
    assert cache_folder() == Path(platformdirs.user_cache_dir("nacre"))


def test_offline_says_how_to_do_without(database, tmp_path):
    away = dataclasses.replace(database, url="http://127.0.0.1:9/{name}")
    line = (
        rf"cannot reach 127\.0\.0\.1: Connection refused; the file can also be fetched by hand "
        rf"from http://127\.0\.0\.1:9/known and put at {tmp_path}/known\.bin$"
    )
    with pytest.raises(NacreError, match=line):
        fetch(away, "known", tmp_path, agree=accept)


def test_a_folder_that_cannot_be(database, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(NacreError, match=r"known\.bin: cannot be .*: Not a directory"):
        fetch(database, "known", tmp_path / "file" / "folder", agree=accept)


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_a_folder_that_cannot_be_written(database, tmp_path):
    fetch(database, "unknown", tmp_path, agree=accept)
    tmp_path.chmod(0o500)
    with pytest.raises(NacreError, match=r"known\.bin: cannot be .*: Permission denied"):
        fetch(database, "known", tmp_path, agree=accept)
    tmp_path.chmod(0o700)


def test_a_disk_that_is_full(database, tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(NacreError, match=r"known\.bin: cannot be .*: File too large$"):
            fetch(database, "known", tmp_path, agree=accept)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not (tmp_path / "known.bin").exists()
    assert fetch(database, "known", tmp_path).verified


def _fetch(database: Database, folder: str, barrier, results) -> None:
    barrier.wait()
    results.put(fetch(database, "known", folder, agree=accept))


def test_processes_at_once_share_one_download(database, server, content, tmp_path):
    context = multiprocessing.get_context("spawn")
    barrier, results = context.Barrier(4), context.Queue()
    arguments = (database, str(tmp_path), barrier, results)
    processes = [context.Process(target=_fetch, args=arguments) for _ in range(4)]
    for process in processes:
        process.start()
    found = [results.get(timeout=60) for _ in processes]
    for process in processes:
        process.join()
        process.close()
    results.close()
    results.join_thread()
    assert sorted(each.fresh for each in found) == [False, False, False, True]
    assert (tmp_path / "known.bin").read_bytes() == content
    assert len(server.requests) == 1
    assert left(tmp_path) == ["known.bin", "known.bin.json", "shop-TERMS.txt"]


def test_threads_at_once_share_one_download(database, server, tmp_path):
    threads = [
        threading.Thread(target=fetch, args=(database, "known", tmp_path, None, accept))
        for _ in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(server.requests) == 1
    assert fetch(database, "known", tmp_path).verified
