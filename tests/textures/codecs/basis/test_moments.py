"""The compiled loops of encoding against NumPy in double precision."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from nacre.btf import TableBtf
from nacre.errors import FormatError
from nacre.formats import load_btf
from nacre.numerics.channels import split_colors
from nacre.textures.codecs.basis.moments import Moments
from nacre.textures.codecs.basis.networks import FunctionValues, SkipNetwork
from nacre.textures.codecs.basis.posterior import project
from nacre.workflows.encoding import encode
from tests.textures.codecs.basis.made import codec
from tests.textures.codecs.basis.test_basis import random_network
from tests.workflows.test_encoding import COARSE


def functions(pairs: int, luma: int = 37, chroma: int = 19) -> FunctionValues:
    random = np.random.default_rng(3)
    shapes = (pairs,), (pairs, luma), (pairs, chroma)
    mean, *others = (random.normal(size=shape).astype(np.float32) for shape in shapes)
    return FunctionValues(mean, *others)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize(("texels", "pairs"), [(1, 1), (9, 128), (8, 300)])
def test_moments_are_sums_over_pairs(texels: int, pairs: int, dtype: npt.DTypeLike) -> None:
    made = functions(pairs)
    values = np.random.default_rng(4).normal(0.3, 0.3, (texels, pairs, 3)).astype(dtype)
    luma, chroma = split_colors(np.sqrt(np.maximum(values.astype(np.float64), 0.0)))
    expected = [(luma - made.mean) @ made.luma, *(c @ made.chroma for c in chroma)]
    found = Moments(made)(values)
    np.testing.assert_allclose(found, np.concatenate(expected, axis=1), rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_moments_tell_what_is_not_finite(bad: float, dtype: npt.DTypeLike) -> None:
    values = np.full((3, 200, 3), 0.5, dtype)
    values[1, 150, 2] = bad
    found = np.isfinite(Moments(functions(200))(values))
    assert found[[0, 2]].all()
    assert not found[1].all()


def test_a_step_solves_the_normal_equations() -> None:
    decode: SkipNetwork = random_network(20, 40)
    random = np.random.default_rng(5)
    wanted = decode(random.normal(size=(19, 20)).astype(np.float32))
    start = np.zeros((19, 20), np.float32)
    value, slopes = (part.astype(np.float64) for part in decode.jacobian(start))
    curvature = slopes @ slopes.swapaxes(1, 2)
    curvature[:, np.arange(20), np.arange(20)] *= 1.01
    expected = np.linalg.solve(curvature, slopes @ (wanted - value)[..., None])[..., 0]
    found = project(start, wanted, decode, 1)
    moved = np.abs(found).max(1) > 0.0
    assert moved.sum() > 10
    np.testing.assert_allclose(found[moved], expected[moved], rtol=1e-3, atol=1e-4)


def test_halves_give_the_codes_of_the_same_numbers(tmp_path: Path) -> None:
    values = np.random.default_rng(6).random((3, 4, len(COARSE[0]), 3)).astype(np.float16)
    path = tmp_path / "made.npz"
    np.savez(path, values=values, wi=COARSE[0], wo=COARSE[1])
    halves, singles = load_btf(path), TableBtf(values.astype(np.float32), *COARSE)
    found, expected = (encode(btf, codec(), texels_per_block=5) for btf in (halves, singles))
    np.testing.assert_array_equal(found.codes, expected.codes)
    assert found.errors == expected.errors
    values[2, 1, 3, 0] = np.inf
    np.savez(path, values=values, wi=COARSE[0], wo=COARSE[1])
    with pytest.raises(FormatError, match="values: some are not finite"):
        encode(load_btf(path), codec())
