"""Networks of texels as `.safetensors` files: tensors, and what they mean as JSON."""

from __future__ import annotations

from dataclasses import asdict, fields
from functools import partial
from typing import Any

import numpy as np

from nacre.btf.networks.custom import CustomNetwork, CustomSettings
from nacre.btf.networks.network import TexelNetwork
from nacre.btf.networks.preprocessing import Whitening
from nacre.btf.networks.unified import UnifiedNetwork, UnifiedSettings
from nacre.files import FormatError, PathLike, check_json, reason, write_encoded
from nacre.tensors import Tensors, check_numbers, from_file, to_bytes

VERSION = 1
PRECISIONS: dict[str, np.dtype[Any]] = {
    "single": np.dtype(np.float32),
    "half": np.dtype(np.float16),
}
"""Of the weights in a file; directions are single always."""
_KEY = "nacre texel network"
_LIMIT = 1 << 28
_LARGEST = 1e6
_SETTINGS: dict[str, type[UnifiedSettings] | type[CustomSettings]] = {
    "unified": UnifiedSettings,
    "custom": CustomSettings,
}


def save_network(network: TexelNetwork, path: PathLike, precision: str = "single") -> None:
    """Write a network; the same network gives the same bytes.

    Parameters
    ----------
    network, path
        What to write, and where.
    precision
        Of the weights, one of :data:`PRECISIONS`.

    Raises
    ------
    FormatError
        If the path cannot be written, or a weight is too large.
    """
    write_encoded(path, partial(_encode, precision=precision), network)


def load_network(path: PathLike) -> TexelNetwork:
    """Read a network, onto the CPU.

    Raises
    ------
    FormatError
        If the file is not a whole network of a version we know.
    """
    header, tensors = from_file(path, _KEY, _LIMIT, "a network of texels")
    try:
        return _from_header(header, tensors)
    except KeyError as error:
        raise FormatError(f"{path}: field {reason(error)} is missing") from error
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise FormatError(f"{path}: {reason(error)}") from error


def _encode(network: TexelNetwork, precision: str) -> bytes:
    tensors: Tensors = network.arrays()
    try:
        check_numbers(tensors, _LARGEST if precision == "single" else 65504.0)
    except ValueError as error:
        raise FormatError(str(error)) from error
    kind = PRECISIONS[precision]
    tensors = {name: array.astype(kind) for name, array in tensors.items()}
    if isinstance(network, CustomNetwork):
        tensors |= {"wi": network.wi, "wo": network.wo}
    header = {
        "version": VERSION,
        "model": network.model,
        "settings": asdict(network.settings),
        "values": "whitened log(pi f_r + offset), linear Rec. 709",
        "whitening": asdict(network.whitening),
        "metadata": network.metadata,
    }
    return to_bytes(_KEY, header, tensors, _LIMIT)


def _from_header(header: dict[str, Any], tensors: Tensors) -> TexelNetwork:
    if header["version"] != VERSION:
        raise ValueError(f"version {header['version']!r}; this nacre reads version {VERSION}")
    if header["model"] not in _SETTINGS:
        raise ValueError(f"unknown model {header['model']!r}; update nacre")
    metadata = header["metadata"]
    if not isinstance(metadata, dict):
        raise ValueError("metadata is not an object")
    check_json(header)  # so that what was read can be written again
    whitening = Whitening(**{key: float(value) for key, value in header["whitening"].items()})
    settings = _settings(_SETTINGS[header["model"]], header["settings"])
    kinds = {array.dtype for name, array in tensors.items() if name not in ("wi", "wo")}
    if len(kinds) != 1 or not kinds <= set(PRECISIONS.values()):
        raise ValueError("weights are not float32 or float16 numbers, all alike")
    arrays = {name: array.astype(np.float32) for name, array in tensors.items()}
    check_numbers(arrays, _LARGEST)
    if isinstance(settings, UnifiedSettings):
        return UnifiedNetwork(settings, whitening, arrays, metadata=metadata)
    wi, wo = arrays.pop("wi"), arrays.pop("wo")
    for name, array in (("wi", wi), ("wo", wo)):
        if array.ndim != 2 or not np.allclose(np.square(array).sum(axis=-1), 1.0, atol=1e-3):
            raise ValueError(f"{name} are no unit directions")
    return CustomNetwork(wi, wo, settings, whitening, arrays, metadata=metadata)


def _settings(
    kind: type[UnifiedSettings] | type[CustomSettings], found: dict[str, Any]
) -> UnifiedSettings | CustomSettings:
    """Settings from JSON, whose lists are tuples here."""
    if set(found) != {field.name for field in fields(kind)}:
        raise ValueError(f"settings are {sorted(found)}, others than this nacre knows")
    values: dict[str, Any] = {}
    for name, value in found.items():
        default = getattr(kind, name)
        wanted = tuple if isinstance(default, tuple) else type(default)
        value = tuple(value) if isinstance(value, list) else value
        members = value if isinstance(value, tuple) else ()
        if type(value) is not wanted or not all(type(v) is int for v in members):
            raise ValueError(f"setting {name} is {value!r}, expected a {wanted.__name__}")
        values[name] = value
    return kind(**values)
