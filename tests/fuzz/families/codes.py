"""Bases and codes of materials, codecs and maps of textures, and what `nacre info` shows."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from nacre.errors import NacreError
from nacre.latent.basis import LatentBasis
from nacre.latent.file import load_basis, load_code
from nacre.targets.blender_addon.reading import MaterialError, read_file
from nacre.textures.codecs.codec_file import codec_facts, load_codec
from nacre.textures.embedding import load_embedding_map
from nacre.workflows.inspection import inspect
from tests.fuzz.damage import json_damage, tensors_damage
from tests.fuzz.readers import reader
from tests.reading import check_values
from tests.specimens.networks import SPECIMENS as NETWORKS

_WRITTEN = Path(__file__).parents[2] / "fixtures" / "written"
_W = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.6, 0.8]], np.float32)


def _files(pattern: str) -> Callable[[], list[bytes]]:
    """Files that nacre 0.1.0 wrote."""

    def files() -> list[bytes]:
        found = [path.read_bytes() for path in sorted(_WRITTEN.glob(pattern))]
        assert found
        return found

    return files


def _read_basis(path: Path) -> None:
    basis = load_basis(path)
    json.dumps(basis.describe(), ensure_ascii=False).encode()
    check_values(basis.decode(np.full(basis.code_dim, 0.1)))


_KINDS = "neural", "hypernetwork", "autoencoder"


@cache
def _basis(kind: str) -> LatentBasis:
    return load_basis(_WRITTEN / "latent" / f"basis-{kind}.safetensors")


def _read_code(path: Path) -> None:
    kind = next((k for k in _KINDS if f'"{k} code"'.encode() in path.read_bytes()), "pca")
    check_values(load_code(path, _basis(kind)))


def _read_codec(path: Path) -> None:
    json.dumps(codec_facts(path), ensure_ascii=False).encode()
    codec = load_codec(path)
    if codec.any_directions:
        decoded = codec.decoder(_W, _W)(np.full((2, codec.code_dim), 0.1, np.float32))
        assert decoded.shape == (2, 3, 3)
        assert np.isfinite(decoded).all(), "reflectance is not finite"


def _read_map(path: Path) -> None:
    chart = load_embedding_map(path)
    assert len(chart.labels) == len(chart.codes)


def _read_facts(path: Path) -> None:
    json.dumps(inspect(path, physics=False).facts, ensure_ascii=False).encode()


def _read_in_blender(path: Path) -> None:
    try:
        read_file(path)
    except MaterialError as error:
        raise NacreError(f"{path}: {error}") from error


_BASES, _CODES = _files("latent/basis-*.safetensors"), _files("latent/code-[ahnp]*[kra].json")
_CODECS, _MAPS = _files("textures/model-*.safetensors"), _files("textures/places.safetensors")
_MODELS = _files("analytic/*.json")


def _exported() -> list[bytes]:
    """Files of the model that the add-on makes nodes of."""
    from nacre.analytic.file import encode
    from tests.analytic.materials import EXAMPLES

    return [encode(EXAMPLES[name]) for name in EXAMPLES if name.startswith("principled")]


def _inspected() -> list[bytes]:
    return [*_BASES()[:2], *_CODECS()[:2], *_MAPS(), *NETWORKS["nacre neural material"].files()]


_tensors: Callable[..., Any] = partial(reader, memory=64 << 20)

READERS = (
    _tensors("basis", "a.safetensors", _BASES, tensors_damage(_BASES), _read_basis),
    reader("code", "a.json", _CODES, json_damage(_CODES), _read_code),
    _tensors("codec", "a.safetensors", _CODECS, tensors_damage(_CODECS), _read_codec),
    _tensors("map of texels", "a.safetensors", _MAPS, tensors_damage(_MAPS), _read_map),
    _tensors(
        "info of tensors", "a.safetensors", _inspected, tensors_damage(_inspected), _read_facts
    ),
    reader("info of JSON", "a.json", _CODES, json_damage(_CODES), _read_facts),
    reader("Blender add-on", "a.json", _exported, json_damage(_exported), _read_in_blender),
)
