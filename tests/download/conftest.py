from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from tests.download.server import Server, serving


@pytest.fixture
def content() -> bytes:
    """Longer than one chunk of a transfer, and no part of it like another."""
    return np.random.default_rng(0).bytes(300_000)


@pytest.fixture
def server(content: bytes, monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    for name in ("NACRE_MIRROR", "NACRE_CACHE", "http_proxy", "HTTP_PROXY", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("nacre.download.transfer.PAUSE", 0.0)
    with serving(content) as server:
        yield server
