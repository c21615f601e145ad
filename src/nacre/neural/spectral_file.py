"""Spectral networks in nacre's files, for :mod:`nacre.neural.file`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nacre.io.tensors import Tensors, check_numbers
from nacre.neural import chain_file
from nacre.neural.nbrdf import PRECISIONS, check_weights
from nacre.neural.spectral import MOST_COEFFICIENTS, SpectralBrdf
from nacre.numerics.mlp import SQUARED_RELU
from nacre.sampling import make_sampler

MODEL = "spectral"
_FIELDS = (
    *("version", "model", "sizes", "activations", "inputs", "isotropic", "color_space", "name"),
    *("sampler", "channels", "notes", "wavelengths"),
)
_MOST_LAYERS = 8
_MOST_BANDS = 4096
_LARGEST = 100.0  # of the numbers of spectra: sums of e^x times them do not overflow


def described(network: SpectralBrdf) -> dict[str, Any]:
    """The header of a file; FormatError where a file cannot hold the network."""
    assert network.wavelengths is not None
    return {
        **network.metadata,
        **chain_file.described(network),
        "model": MODEL,
        "sizes": list(network.sizes[:-1]),
        "activations": list(network.activations[:-1]),
        "wavelengths": network.wavelengths.tolist(),
        "channels": list(network.channels),
    }


def made(header: Mapping[str, Any], tensors: Tensors) -> SpectralBrdf:
    """The network of a header; KeyError, TypeError or ValueError where it is not whole."""
    if header["version"] != 1:
        raise ValueError(f"version {header['version']}; this nacre reads version 1")
    chain_file.check_fields(header)
    sizes, wavelengths = header["sizes"], header["wavelengths"]
    if len(sizes) - 1 > _MOST_LAYERS or not 1 <= int(sizes[-1]) <= MOST_COEFFICIENTS:
        raise ValueError("field 'sizes' has too many layers or coefficients")
    if not isinstance(wavelengths, list) or not 1 <= len(wavelengths) <= _MOST_BANDS:
        raise ValueError(f"field 'wavelengths' does not list 1 to {_MOST_BANDS} numbers")
    layers, spectra = chain_file.numbered_layers(tensors, len(sizes) - 1), tensors["spectra"]
    kinds = {array.dtype for name, array in tensors.items() if not name.startswith("biases")}
    stored = [name for name, kind in PRECISIONS.items() if kinds <= {kind}]
    if not stored:
        raise ValueError("weights do not hold float32 or float16 numbers, all alike")
    check_weights(layers, SQUARED_RELU)
    check_numbers({"spectra": spectra}, _LARGEST)
    network = SpectralBrdf(
        layers,
        header["activations"],
        spectra,
        wavelengths,
        inputs=header["inputs"],
        isotropic=header["isotropic"],
        name=str(header["name"]),
        sampler=make_sampler(header["sampler"]),
        metadata={key: value for key, value in header.items() if key not in _FIELDS},
        precision=stored[0],
    )
    if list(network.sizes[:-1]) != sizes:
        raise ValueError(f"tensors have sizes {network.sizes[:-1]}, the header says {sizes}")
    return network
