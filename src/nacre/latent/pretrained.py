"""The bases that come with nacre."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from nacre.latent.file import AnyBasis, load_basis
from nacre.latent.hypernetwork import Hypernetwork
from nacre.latent.neural_basis import NeuralBasis

SHIPPED = "neural", "hypernetwork"
"""Their names."""


@cache
def pretrained_hypernetwork() -> Hypernetwork:
    """Codes of 32 values for networks of 675 weights, trained on the published NBRDF networks.

    By `python -m studies.ablations.shipped_codes`, which says on which of them.
    """
    basis = load_basis(Path(__file__).with_name("published.safetensors"))
    assert isinstance(basis, Hypernetwork)
    return basis


def pretrained_basis() -> NeuralBasis:
    """The neural basis that :func:`pretrained_hypernetwork` has its codes from."""
    return pretrained_hypernetwork().basis


def find_basis(name: str) -> AnyBasis:
    """The shipped basis of a name, or that in a file.

    Raises
    ------
    FormatError
        If it is no name of a shipped one, and the file is not a whole basis.
    """
    if name not in SHIPPED:
        return load_basis(name)
    return pretrained_basis() if name == "neural" else pretrained_hypernetwork()
