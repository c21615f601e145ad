"""Settings of trainings that are refused."""

from __future__ import annotations

import pytest

from nacre.latent import (
    AutoencoderRecipe,
    BasisRecipe,
    HypernetworkRecipe,
    PcaRecipe,
    PredictorRecipe,
)


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        (PcaRecipe, "code_dim"),
        (BasisRecipe, "code_dim steps directions batch"),
        (PredictorRecipe, "hidden codes sets lights steps batch"),
        (HypernetworkRecipe, "code_dim width steps codes directions"),
        (AutoencoderRecipe, "code_dim width steps networks pixels"),
    ],
)
def test_numbers_below_one_are_refused_by_name(kind, names):
    for name in names.split():
        with pytest.raises(ValueError, match=f"{name} must be positive, got 0"):
            kind(**{name: 0})


def test_a_basis_has_hidden_layers():
    for widths in ((), (16, 0)):
        with pytest.raises(ValueError, match="hidden must be widths of layers"):
            BasisRecipe(hidden=widths)


def test_an_autoencoder_needs_no_mixtures_and_takes_no_fewer():
    assert AutoencoderRecipe(mixtures=0).mixtures == 0
    with pytest.raises(ValueError, match="mixtures must not be negative"):
        AutoencoderRecipe(mixtures=-1)
