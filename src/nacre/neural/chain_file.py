"""Chains of layers in nacre's files, for :mod:`nacre.neural.file`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from nacre.brdf import COLOR
from nacre.errors import FormatError
from nacre.io.tensors import Tensors
from nacre.neural.chain import INPUTS, ChainBrdf
from nacre.numerics.mlp import Layer
from nacre.sampling import describe_sampler, make_sampler

MODEL = "chain"
_MOST = 64  # layers


def described(network: ChainBrdf) -> dict[str, Any]:
    """The header of a file; FormatError where a file cannot hold the network."""
    if network.inputs not in INPUTS:
        raise FormatError("the inputs are a function, which files cannot hold; name them")
    try:
        sampler = describe_sampler(network.sampler)
    except ValueError as error:
        raise FormatError(str(error)) from error
    header: dict[str, Any] = {
        "version": 1,
        "model": MODEL,
        "sizes": list(network.sizes),
        "activations": list(network.activations),
        "inputs": network.inputs,
        "isotropic": network.isotropic,
        "color_space": "linear Rec. 709",
        "name": network.name,
        "sampler": sampler,
    }
    if network.channels != COLOR:
        header["color_space"], header["channels"] = "none", list(network.channels)
    return header | ({"notes": list(network.notes)} if network.notes else {})


def made(header: Mapping[str, Any], tensors: Tensors) -> ChainBrdf:
    """The network of a header; KeyError, TypeError or ValueError where it is not whole."""
    check_fields(header)
    sizes, activations = header["sizes"], header["activations"]
    network = ChainBrdf(
        numbered_layers(tensors, len(sizes) - 1),
        activations,
        inputs=header["inputs"],
        isotropic=header["isotropic"],
        name=str(header["name"]),
        sampler=make_sampler(header["sampler"]),
    )
    if list(network.sizes) != sizes:
        raise ValueError(f"tensors have sizes {network.sizes}, the header says {sizes}")
    return network


def check_fields(header: Mapping[str, Any]) -> None:
    """Refuse fields of the wrong kind; KeyError or ValueError says which."""
    sizes, activations = header["sizes"], header["activations"]
    if not isinstance(sizes, list) or not 2 <= len(sizes) <= _MOST + 1:
        raise ValueError(f"field 'sizes' does not list 2 to {_MOST + 1} numbers")
    if not isinstance(activations, list) or not all(isinstance(a, str) for a in activations):
        raise ValueError("field 'activations' is not a list of texts")
    if not isinstance(header["inputs"], str) or not isinstance(header["isotropic"], bool):
        raise ValueError("field 'inputs' is not a text, or 'isotropic' neither true nor false")


def numbered_layers(tensors: Tensors, count: int) -> list[Layer]:
    """Layers from 1 to a count; KeyError where one is missing."""
    return [
        Layer(tensors[f"weights_{number}"], tensors[f"biases_{number}"])
        for number in range(1, count + 1)
    ]


def numbered_tensors(layers: Sequence[Layer], prefix: str = "") -> Tensors:
    """Weights and biases of layers, numbered from 1."""
    return {
        f"{prefix}{part}_{index}": array
        for index, layer in enumerate(layers, 1)
        for part, array in zip(("weights", "biases"), layer, strict=True)
    }
