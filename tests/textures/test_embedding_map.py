"""Texels in the plane."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.io.tensors import from_file, to_bytes
from nacre.measured.textures import BONN
from nacre.textures import LatentMap
from nacre.textures.embedding import (
    EmbeddingMap,
    embed_texels,
    load_embedding_map,
    save_embedding_map,
)
from tests.textures.codecs.basis.made import codec

pytest.importorskip("openTSNE", reason="needs the extra 'latent'")


def _texture(center: float, seed: int = 0, of: int = 0) -> LatentMap:
    random = np.random.default_rng([seed, 5])
    codes = center + 0.1 * random.normal(size=(4, 5, 2))
    wi, wo = (w[:2] for w in BONN.pairs())
    return LatentMap(codes.astype(np.float32), codec(of), wi, wo)


@pytest.fixture(scope="module")
def chart() -> EmbeddingMap:
    return embed_texels([_texture(-2.0), _texture(2.0)], ["low", "high"], 15)


def _distances(chart: EmbeddingMap) -> np.ndarray:
    return np.linalg.norm(chart.places[:, None] - chart.places, axis=2)


def test_texels_that_look_alike_lie_together(chart) -> None:
    assert chart.labels == ["low"] * 15 + ["high"] * 15
    assert len(np.unique(chart.xy[:15], axis=0)) == 15
    assert (chart.xy < [5, 4]).all()
    distances = _distances(chart)
    assert distances[:15, :15].mean() < 0.5 * distances[:15, 15:].mean()
    again = embed_texels([_texture(-2.0), _texture(2.0)], ["low", "high"], 15)
    assert np.array_equal(again.places, chart.places)


def test_new_texels_come_to_their_like_and_old_ones_stay(chart) -> None:
    both = embed_texels([_texture(2.0, 1)], ["new"], 6, onto=chart)
    assert both.names == ("low", "high", "new")
    assert np.array_equal(both.places[:30], chart.places)
    distances = _distances(both)[30:]
    assert (distances[:, 15:30].mean(1) < distances[:, :15].mean(1)).all()


def test_a_map_is_read_as_it_was_written(chart, tmp_path: Path) -> None:
    save_embedding_map(chart, tmp_path / "map.safetensors")
    found = load_embedding_map(tmp_path / "map.safetensors")
    assert (found.names, found.fingerprint) == (chart.names, chart.fingerprint)
    for name in ("texture", "xy", "codes", "places", "colors"):
        assert np.array_equal(getattr(found, name), getattr(chart, name))


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("names", ["low"], "more than 1 textures"),
        ("names", ["low", "low"], "not distinct"),
        ("names", "low", "not a list"),
        ("version", 9, "version 9"),
        ("places", np.zeros((3, 2)), "have shapes"),
        ("places", np.full((30, 2), np.nan), "not finite"),
        ("codes", np.zeros((30, 2)), "of type float64"),
        ("xy", np.full((30, 2), -1), "below 0"),
    ],
)
def test_damaged_maps_are_refused(chart, tmp_path: Path, key, value, words) -> None:
    path = tmp_path / "map.safetensors"
    save_embedding_map(chart, path)
    header, tensors = from_file(path, "nacre map of texels", 1 << 20, "")
    (tensors if key in tensors else header)[key] = value
    path.write_bytes(to_bytes("nacre map of texels", header, tensors, 1 << 20))
    with pytest.raises(FormatError, match=words) as caught:
        load_embedding_map(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_what_is_no_map_of_these_texels_is_refused(chart) -> None:
    with pytest.raises(NacreError, match="another model"):
        embed_texels([_texture(0.0, of=1)], ["other"], 5, onto=chart)
    with pytest.raises(NacreError, match="low: appears twice"):
        embed_texels([_texture(0.0)], ["low"], 5, onto=chart)
    with pytest.raises(NacreError, match="at least 5 texels, got 4"):
        embed_texels([_texture(0.0)], ["few"], 4)
    with pytest.raises(ValueError, match="codes are"):
        replace(chart, codes=chart.codes[:3])
