"""Networks of texels as `.safetensors` files: tensors, and what they mean as JSON."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import Any

from nacre.io.tensors import Tensors, check_header, check_unit_vectors, in_precision, in_single
from nacre.textures.codecs.networks.custom import CustomNetwork, CustomSettings
from nacre.textures.codecs.networks.network import TexelNetwork
from nacre.textures.codecs.networks.preprocessing import Whitening
from nacre.textures.codecs.networks.unified import UnifiedNetwork, UnifiedSettings

VERSION = 1
_SETTINGS: dict[str, type[UnifiedSettings] | type[CustomSettings]] = {
    "unified": UnifiedSettings,
    "custom": CustomSettings,
}


def pack_network(
    network: TexelNetwork, precision: str | None = "single"
) -> tuple[dict[str, Any], Tensors]:
    """Header and tensors of a network; see :func:`nacre.textures.codecs.codec_file.pack_codec`."""
    tensors = in_precision(network.arrays(), precision)
    if isinstance(network, CustomNetwork):  # directions are single always
        tensors |= {"wi": network.wi, "wo": network.wo}
    header = {
        "version": VERSION,
        "model": network.model,
        "settings": asdict(network.settings),
        "values": "whitened log(pi f_r + offset), linear Rec. 709",
        "whitening": asdict(network.whitening),
        "metadata": network.metadata,
    }
    return header, tensors


def unpack_network(header: dict[str, Any], tensors: Tensors) -> TexelNetwork:
    """A network, onto the CPU; see :func:`nacre.textures.codecs.codec_file.unpack_codec`."""
    check_header(header, VERSION)
    metadata = header["metadata"]
    whitening = Whitening(**{key: float(value) for key, value in header["whitening"].items()})
    settings = _settings(_SETTINGS[header["model"]], header["settings"])
    arrays = in_single({k: v for k, v in tensors.items() if k not in ("wi", "wo")})
    if isinstance(settings, UnifiedSettings):
        return UnifiedNetwork(settings, whitening, arrays, metadata=metadata)
    wi, wo = tensors["wi"], tensors["wo"]
    check_unit_vectors({"wi": wi, "wo": wo})
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
