"""The wavelet: exact inverses, the filters of the standard, and equal weights of all bands."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.textures.rates.wavelet import band_shapes, compose, decompose

LOW = (0.602949018236, 0.266864118443, -0.078223266529, -0.016864118443, 0.026748757411)
"""The analysis filter of JPEG 2000 (ISO/IEC 15444-1, table F.4), from the middle outward."""


@pytest.mark.parametrize("shape", [(3, 37, 50), (2, 1, 1), (1, 1, 7), (4, 64, 3), (0, 9, 9)])
@pytest.mark.parametrize("levels", [0, 1, 4])
def test_maps_come_back(shape: tuple[int, int, int], levels: int) -> None:
    maps = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    bands = decompose(maps, levels)
    found = [[band.shape[1:] for band in level] for level in bands]
    assert found == band_shapes(*shape[1:], levels)
    assert compose(bands) == pytest.approx(maps, abs=1e-5)


def test_means_are_those_of_the_filter_of_the_standard() -> None:
    line = np.zeros((1, 1, 33), np.float32)
    line[0, 0, 16] = 1.0
    (mean,), (_, _, _) = decompose(line, 1)
    near = mean[0, 0, 8 - 2 : 8 + 3]
    wanted = np.array([LOW[4], LOW[2], LOW[0], LOW[2], LOW[4]])
    assert near / near[2] == pytest.approx(wanted / LOW[0], abs=1e-6)


def test_rounding_of_all_bands_is_about_as_harmful() -> None:
    random = np.random.default_rng(0)
    shapes = band_shapes(128, 128, 4)
    for number, level in enumerate(shapes):
        bands = [[np.zeros((1, *shape), np.float32) for shape in part] for part in shapes]
        bands[number] = [random.normal(size=(1, *s)).astype(np.float32) for s in level]
        count = sum(band.size for band in bands[number])
        assert 0.5 < np.square(compose(bands)).sum() / count < 2.0
