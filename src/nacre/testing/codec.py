"""What every texture codec keeps."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.btf import TableBtf
from nacre.testing.cases import Checks, Contracts, maker
from nacre.textures.codecs import CODECS, TexelCodec, TrainingRun, load_codec, save_codec

CONTRACTS = Contracts()


def check_codec(codec: TexelCodec | type[TexelCodec] | Callable[[], TexelCodec]) -> Checks:
    """Contracts of a texture codec: codes, what they decode to, and its file.

    Parameters
    ----------
    codec
        A codec that works at any directions; a function that makes it; or a class, which is then
        trained on two small textures with its default recipe. A file is written if its kind is
        registered.
    """
    if isinstance(codec, type):
        kind = codec
        return CONTRACTS.of(lambda: _trained(kind))
    return CONTRACTS.of(maker(codec, TexelCodec))


def _directions(seed: int, count: int) -> tuple[Floats, Floats]:
    """Pairs of directions up to 75 degrees from the normal, shape (count, 3) each."""
    random = np.random.default_rng(seed)
    height = random.uniform(np.cos(np.radians(75.0)), 1.0, (2, count))
    phi, radius = random.uniform(0.0, 2.0 * np.pi, (2, count)), np.sqrt(1.0 - height**2)
    w = np.stack([radius * np.cos(phi), radius * np.sin(phi), height], -1).astype(np.float32)
    return w[0], w[1]


def made_texture(seed: int, size: int = 6, pairs: int = 200) -> TableBtf:
    """A texture whose diffuse color and glossy lobe change from texel to texel."""
    random = np.random.default_rng(seed)
    wi, wo = _directions(1, pairs)
    half = wi + wo
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    shape = (size, size, 1, 1)
    color = random.uniform(0.05, 0.8, 3) * random.uniform(0.5, 1.0, shape)
    lobe = half[:, 2:] ** random.uniform(5.0, 60.0, shape) * random.uniform(0.0, 1.0, shape)
    return TableBtf((color + lobe).astype(np.float32), wi, wo, f"made {seed}")


def _trained(kind: type[TexelCodec]) -> TexelCodec:
    textures = {Path(f"{seed}"): made_texture(seed) for seed in (0, 1)}
    run = TrainingRun(list(textures), lambda path: textures[Path(path)])
    return kind.train(run, kind.recipe())


@CONTRACTS.add
def _codes_are_finite_and_of_the_size_that_is_said(codec: TexelCodec) -> None:
    texture = made_texture(2)
    codes = codec.encoder(texture.wi, texture.wo)(texture.texels(slice(None)))
    assert codes.shape == (texture.texel_count, codec.code_dim)
    assert np.isfinite(codes).all()


@CONTRACTS.add
def _decoded_texels_are_finite_and_near_what_was_encoded(codec: TexelCodec) -> None:
    texture = made_texture(2)
    texels = texture.texels(slice(None))
    codes = codec.encoder(texture.wi, texture.wo)(texels)
    decoded = codec.decoder(texture.wi, texture.wo)(codes)
    assert decoded.shape == texels.shape
    assert np.isfinite(decoded).all()
    assert (decoded >= 0.0).all()
    error = np.square(decoded - texels).mean()
    spread = np.square(texels - texels.mean(axis=(0, 1))).mean()
    assert error < spread, f"worse than the mean color: {error:.3g} against {spread:.3g}"


@CONTRACTS.add
def _codes_decode_at_other_directions(codec: TexelCodec) -> None:
    if not codec.any_directions:
        return
    texture = made_texture(2)
    codes = codec.encoder(texture.wi, texture.wo)(texture.texels(slice(0, 5)))
    decoded = codec.decoder(*_directions(2, 60))(codes)
    assert decoded.shape == (5, 60, 3)
    assert np.isfinite(decoded).all()


@CONTRACTS.add
def _texels_do_not_depend_on_others(codec: TexelCodec) -> None:
    texture = made_texture(2)
    texels = texture.texels(slice(None))
    encode = codec.encoder(texture.wi, texture.wo)
    decode = codec.decoder(texture.wi, texture.wo)
    codes, part = encode(texels), encode(texels[3:9])
    size = np.abs(codes).max()
    np.testing.assert_allclose(part, codes[3:9], rtol=1e-3, atol=1e-4 * size)
    np.testing.assert_allclose(decode(codes[3:9]), decode(codes)[3:9], rtol=1e-4, atol=1e-5)


@CONTRACTS.add
def _a_file_reads_back_the_same(codec: TexelCodec) -> None:
    if CODECS.get(codec.kind) is not type(codec):
        return
    with tempfile.TemporaryDirectory(prefix="nacre-testing-") as folder:
        first, second = (Path(folder) / f"{name}.safetensors" for name in "ab")
        save_codec(codec, first)
        save_codec(codec, second)
        assert first.read_bytes() == second.read_bytes(), "the same codec gives other bytes"
        again = load_codec(first)
    texture = made_texture(2)
    codes = codec.encoder(texture.wi, texture.wo)(texture.texels(slice(None)))
    decoders = [each.decoder(texture.wi, texture.wo) for each in (codec, again)]
    np.testing.assert_allclose(decoders[1](codes), decoders[0](codes), rtol=1e-5, atol=1e-6)
