"""Samplers by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.measured.rgl import tabulate
from nacre.measured.rgl_writer import COMPACT
from nacre.reproduce.samplers import FITTED, PREDICTED, SAMPLERS, find_sampler
from nacre.sampling.parametrizations import PARAMETRIZATIONS
from tests.latent.made import predictor, random_basis
from tests.reflectances import Brushed, Glossy

CODE = np.array([0.9, -1.3, 0.4, 0.2, 1.1, -0.7])


def test_what_is_predicted_is_that_of_the_code() -> None:
    basis = replace(random_basis(), predictors={name: predictor(name) for name in PARAMETRIZATIONS})
    brdf = random_basis().decode(CODE)
    for name, family in PREDICTED.items():
        expected = basis.predictors[family](basis.encode(brdf))
        assert find_sampler(name, basis)(brdf) == expected
    with pytest.raises(FormatError, match="is anisotropic"):
        find_sampler("ggx-predicted", basis)(Brushed())


def test_without_a_basis_nothing_is_predicted() -> None:
    for basis in (None, random_basis(), replace(random_basis(), predictors={})):
        with pytest.raises(NacreError, match="ggx-predicted: needs --basis"):
            find_sampler("ggx-predicted", basis)


def test_a_table_brings_its_warp_and_others_get_one() -> None:
    table = tabulate(Glossy(0.2, 0.3, 0.2), COMPACT)
    assert find_sampler("rgl")(table) is table.sampler is find_sampler("own")(table)
    made = find_sampler("rgl")(Glossy(0.2, 0.3, 0.2))
    assert str(made) == str(table.sampler)


def test_every_sampler_has_one_name() -> None:
    assert set(FITTED).isdisjoint(PREDICTED)
    assert sorted(SAMPLERS) == sorted((*FITTED, *PREDICTED))
