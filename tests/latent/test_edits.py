"""Named directions in the space of codes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.errors import NacreError
from nacre.latent import pretrained_basis
from nacre.latent.directions import shared_directions
from nacre.latent.edits import COLORING, NAMES, edits, traits
from nacre.numerics.channels import CHROMA
from tests.latent.made import basis, random_basis, random_hypernetwork

WHOLE = pretrained_basis()
OTHERS = WHOLE.examples[2::12]
"""Codes that the directions of :func:`known` have not seen."""


@pytest.fixture(scope="module")
def known():
    return edits(replace(WHOLE, examples=WHOLE.examples[::6]))


@pytest.fixture(scope="module")
def before():
    """Traits of the others, shape (materials, 3)."""
    return np.array([levels(WHOLE.decode(code)) for code in OTHERS])


@pytest.fixture(scope="module")
def changes(known, before):
    """Change of the traits by an amount of 1 along each direction, shape (materials, 3)."""
    found = {}
    for name, edit in known.items():
        after = [levels(WHOLE.decode(edit.apply(code, 1.0))) for code in OTHERS]
        found[name] = np.subtract(after, before)
    return found


def levels(material):
    found = traits(material)
    return found.roughness, found.coat, found.base


def test_traits_are_the_parameters_of_the_model():
    made = Ggx(diffuse=(0.3, 0.2, 0.1), specular=(0.04, 0.05, 0.08), roughness=0.3)
    found = traits(made)
    assert found.roughness == pytest.approx(math.log(0.3), abs=0.01)
    assert found.coat == pytest.approx(math.log(0.17 / 3), abs=0.05)
    assert found.base == pytest.approx(math.log(0.2), abs=0.02)
    np.testing.assert_allclose(found.base_color, CHROMA @ np.log([0.3, 0.2, 0.1]), atol=0.02)
    np.testing.assert_allclose(found.coat_color, CHROMA @ np.log([0.04, 0.05, 0.08]), atol=0.05)


@pytest.mark.slow
def test_directions_do_what_they_are_called(before, changes):
    """To materials that they were not found from."""
    wide = before[:, 0] > -4.0  # wide enough for the samples of a fit to show how wide
    sides = {"rougher": (0, 1.0), "glossier coat": (1, 1.0), "darker": (2, -1.0)}
    for name, (trait, sign) in sides.items():
        seen = changes[name][wide]
        change = sign * seen[:, trait]
        assert (change > 0.0).mean() > 0.7
        assert 0.1 < np.median(change) < 0.8
        others = np.abs(np.median(np.delete(seen, trait, axis=1), axis=0))
        assert name == "rougher" or (others < 0.5 * np.median(change)).all()
    metal = changes["more metallic"]
    assert (metal[:, 1] > metal[:, 2]).mean() > 0.8


def test_saturation_stretches_the_colors_of_every_direction(known):
    wi, wo = shared_directions(200, 4)
    code = OTHERS[1].astype(float)
    logs = [
        np.log(WHOLE.decode(known["more saturated"].apply(code, amount)).eval(wi, wo)).astype(float)
        for amount in (0.0, 1.0, -1.0 / COLORING)
    ]
    same, more, gray = (x @ CHROMA.T for x in logs)
    np.testing.assert_allclose(more, (1.0 + COLORING) * same, atol=2e-3)
    np.testing.assert_allclose(gray, 0.0, atol=1e-4)
    np.testing.assert_allclose(logs[1].sum(axis=1), logs[0].sum(axis=1), atol=2e-3)


def test_other_orders_of_channels_move_alike(known):
    code = OTHERS[3:4].astype(float)
    for edit in known.values():
        for order in range(6):
            first = WHOLE.permuted(edit.apply(code[0], 1.5)[None], order)[0]
            second = edit.apply(WHOLE.permuted(code, order)[0], 1.5)
            np.testing.assert_allclose(first, second, atol=1e-6)


def test_amounts_add_up_and_none_changes_nothing(known):
    for edit in known.values():
        np.testing.assert_array_equal(edit.apply(OTHERS[0], 0.0), OTHERS[0].astype(float))
        far = edit.apply(OTHERS[0], 2.0) - OTHERS[0]
        np.testing.assert_allclose(far, 2.0 * (edit.apply(OTHERS[0], 1.0) - OTHERS[0]), atol=1e-9)


def test_a_hypernetwork_has_the_directions_of_its_basis():
    found, own = edits(random_hypernetwork()), edits(random_basis())
    assert tuple(found) == NAMES
    for name in NAMES:
        np.testing.assert_array_equal(found[name].offset, own[name].offset)
        np.testing.assert_array_equal(found[name].matrix, own[name].matrix)


def test_bases_without_such_codes_are_refused():
    with pytest.raises(NacreError, match="take a neural basis, got one of kind 'pca'"):
        edits(basis())
    with pytest.raises(NacreError, match="keeps the codes of its materials"):
        edits(replace(random_basis(), examples=random_basis().examples[:1]))
