"""Samplers by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nacre.analytic.labels import MODELS
from nacre.errors import FormatError, NacreError
from nacre.measured.rgl import tabulate
from nacre.measured.rgl_writer import Resolution
from nacre.sampling.parametrizations import PARAMETRIZATIONS
from nacre_lab.reproduce.samplers import FITTED, PREDICTED, SAMPLERS, find_sampler
from tests.latent.made import predictor, random_autoencoder, random_basis
from tests.reflectances import Brushed, Glossy

CODE = np.array([0.9, -1.3, 0.4, 0.2, 1.1, -0.7])


def test_what_is_predicted_is_that_of_the_code() -> None:
    learned = {name: predictor(name) for name in PARAMETRIZATIONS}
    by_labels = {f"{name} by labels": predictor(name, seed=9) for name in MODELS}
    bases = {
        "neural": replace(random_basis(), predictors=learned),
        "autoencoder": replace(random_autoencoder(), predictors=learned | by_labels),
    }
    brdf = random_basis().decode(CODE)
    for name, (kind, key) in PREDICTED.items():
        basis = bases[kind]
        code = basis.encode(brdf, refine=kind == "neural")
        assert find_sampler(name, lambda _, kind: bases[kind])(brdf) == basis.predictors[key](code)
    with pytest.raises(FormatError, match="is anisotropic"):
        find_sampler("ggx-predicted", lambda _, kind: bases[kind])(Brushed())


def test_without_a_basis_nothing_is_predicted() -> None:
    with pytest.raises(NacreError, match="ggx-predicted: needs a basis"):
        find_sampler("ggx-predicted")
    with pytest.raises(NacreError, match="ggx-predicted: the basis has no predictor 'ggx'"):
        find_sampler("ggx-predicted", lambda *_: random_basis())(random_basis().decode(CODE))


def test_a_table_brings_its_warp_and_others_get_one() -> None:
    table = tabulate(Glossy(0.2, 0.3, 0.2), Resolution(1, 12, 17, 4, 32))
    assert find_sampler("rgl")(table) is table.sampler is find_sampler("own")(table)
    made = find_sampler("rgl")(Glossy(0.2, 0.3, 0.2))
    assert str(made) == str(table.sampler)


def test_every_sampler_has_one_name() -> None:
    assert set(FITTED).isdisjoint(PREDICTED)
    assert sorted(SAMPLERS) == sorted((*FITTED, *PREDICTED))
