"""How much memory is left: the least of what the system, the container and `ulimit -v` say."""

from __future__ import annotations

import os
import resource
from pathlib import Path

import pytest

from nacre.io import memory

MIB = 1 << 20


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """What files of the system hold; the others are not there."""
    files: dict[str, str] = {}

    def read_text(path: Path, *_: object, **__: object) -> str:
        try:
            return files[path.name]
        except KeyError:
            raise FileNotFoundError(path) from None

    monkeypatch.setattr(memory.Path, "read_text", read_text)
    monkeypatch.setattr(os, "sysconf", {"SC_AVPHYS_PAGES": 3000, "SC_PAGE_SIZE": 4096}.__getitem__)
    unlimited = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
    monkeypatch.setattr(resource, "getrlimit", lambda which: unlimited)
    return files


def test_free_memory_is_what_the_kernel_calls_available(said: dict[str, str]) -> None:
    said["meminfo"] = "MemTotal: 9000 kB\nMemFree: 10 kB\nMemAvailable:    2048 kB\n"
    assert memory.available_memory() == 2 * MIB
    said["meminfo"] = "MemTotal: 9000 kB\n"
    assert memory.available_memory() is None


def test_elsewhere_free_pages_are_counted(said: dict[str, str]) -> None:
    assert memory.available_memory() == 3000 * 4096


def test_a_container_takes_no_more_than_its_limit(said: dict[str, str]) -> None:
    said |= {"memory.max": f"{10 * MIB}\n", "memory.current": f"{9 * MIB}\n"}
    said["meminfo"] = "MemAvailable: 4096 kB\n"
    assert memory.available_memory() == MIB
    said["memory.current"] = f"{11 * MIB}\n"
    assert memory.available_memory() == 0
    said["memory.max"] = "max\n"
    assert memory.available_memory() == 4 * MIB


def test_the_address_space_that_is_left_is_the_limit_less_what_is_used(
    said: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said |= {"meminfo": "MemAvailable: 4096000 kB\n", "statm": "256 77 1\n"}
    assert memory.address_space() is None
    page = resource.getpagesize()
    limits = {resource.RLIMIT_AS: (300 * page, 400 * page)}
    monkeypatch.setattr(resource, "getrlimit", limits.__getitem__)
    assert memory.address_space() == memory.available_memory() == 44 * page
    said["statm"] = "500 77 1\n"
    assert memory.address_space() == 0
    del said["statm"]
    assert memory.address_space() is None
