"""Principal components as the header and the tensors of a file."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.io.tensors import Tensors, check_header, check_numbers, check_unit_vectors
from nacre.textures.codecs.principal.codec import PcaCodec

MODEL = "principal components"
VERSION = 1
_LARGEST = 1e12
_ARRAYS = ("wi", "wo", "mean", "components", "variances")


def pack_components(codec: PcaCodec) -> tuple[dict[str, Any], Tensors]:
    """Header and tensors, single always; see
    :func:`nacre.textures.codecs.codec_file.pack_codec`.
    """
    tensors = {name: np.ascontiguousarray(getattr(codec, name), np.float32) for name in _ARRAYS}
    header = {
        "version": VERSION,
        "model": MODEL,
        "values": "pi f_r, linear Rec. 709",
        "noise": float(codec.noise),
        "metadata": codec.metadata,
    }
    return header, tensors


def unpack_components(header: dict[str, Any], tensors: Tensors) -> PcaCodec:
    """A codec; see :func:`nacre.textures.codecs.codec_file.unpack_codec`."""
    check_header(header, VERSION)
    noise = header["noise"]
    if not isinstance(noise, float) or not 0.0 < noise < _LARGEST:
        raise ValueError(f"noise is {noise!r}, expected a number above 0")
    arrays = {name: tensors[name] for name in _ARRAYS}
    for name, array in arrays.items():
        if array.dtype != np.float32:
            raise ValueError(f"{name} are not float32 numbers")
    check_numbers(arrays, _LARGEST)
    check_unit_vectors({name: arrays[name] for name in ("wi", "wo")})
    return PcaCodec(**arrays, noise=noise, metadata=header["metadata"])
