"""Files that say more than facts."""

from __future__ import annotations

from typing import Any

import pytest

import nacre
from nacre.neural import NeuralBrdf
from nacre.neural.training import initial_layers
from nacre.targets import TARGETS, preamble
from nacre.targets.source import SourceTarget

EVIL = '1\nfloat evil() { return 1.0; } /* "'


@pytest.mark.parametrize(
    "metadata",
    [
        {"quality": {"weights": EVIL, "memory bytes": EVIL, "model": EVIL, "loss": EVIL}},
        {"quality": {"held_out_loss": EVIL}},
        {"quality": {"held_out_loss": [EVIL], "loss": [1]}},
        {"quality": {"held_out_loss": 0.1, "loss": EVIL}},
        {"source": {"file": EVIL, "sha256": EVIL, "terms": EVIL}},
        {"source": {"file": [EVIL]}},
        {"source": {"file": "a.bsdf"}, "quality": {"held_out_loss": None}},
        {"quality": {"terms of the source": EVIL, "fitted to": 5}},
    ],
)
def test_facts_of_a_file_stay_in_comments(metadata: dict[str, Any], tmp_path) -> None:
    nacre.save(NeuralBrdf(initial_layers((4,), 0), metadata=metadata), tmp_path / "a.safetensors")
    loaded = nacre.load(tmp_path / "a.safetensors")
    assert all(line.isprintable() and line.isascii() for line in preamble(loaded))
    for _, target in TARGETS.members():
        if issubclass(target, SourceTarget):
            content = b"".join(target().files(loaded, "a").values())
            assert b"evil() {" not in content
            assert b'/* "' not in content
