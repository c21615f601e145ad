"""Textures as a map of codes, and what a codec makes from them at any directions."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf, Indices
from nacre.errors import FormatError
from nacre.textures.codecs.codec import TexelCodec, TexelMap, on_all_cores
from nacre.textures.rates.rated_codes import RatedCodes

_BLOCK = 1 << 26  # bytes of values that are decoded at a time for pictures


@dataclass(frozen=True)
class CodecFile:
    """The file that a codec was read from: its name, in the folder of what refers to it, and its
    SHA-256 in hexadecimal. If expanded, codes are those of
    :meth:`nacre.textures.codecs.TexelCodec.expanded`.
    """

    name: str
    sha256: str
    expanded: bool = False


class _Codes:
    """Codes of a map, which are decoded when they are first asked for if few bytes hold them."""

    def __get__(self, latent: LatentMap | None, _: type) -> npt.NDArray[Any]:
        if latent is None:
            raise AttributeError("codes belong to a map")
        held = latent.held
        return held.codes if isinstance(held, RatedCodes) else held

    def __set__(self, latent: LatentMap, held: npt.NDArray[Any] | RatedCodes) -> None:
        vars(latent)["codes"] = held


@dataclass(frozen=True, eq=False)
class LatentMap:
    """A code for every texel; a ValueError says that shapes or types do not fit."""

    codes: npt.NDArray[Any]
    """Shape (height, width, code_dim), float16 or float32. A :class:`RatedCodes` may be given in
    their place: its codes are decoded, all at once, when they are first asked for."""
    codec: TexelCodec
    wi: Floats  # directions of the texture that was encoded, shape (n, 3)
    wo: Floats
    name: str = ""  # the material's
    reference: CodecFile | None = None
    """The codec's file, if files should refer to it; they embed it where None."""
    metadata: dict[str, Any] = field(default_factory=dict)  # JSON-able: the source, the errors
    rated: RatedCodes | None = None
    """How files hold the codes in few bytes; None once a copy has other codes than its own."""

    def __post_init__(self) -> None:
        held, rated = vars(self)["codes"], self.rated
        if isinstance(held, RatedCodes):
            rated = held
        elif rated is not None and held is not vars(rated).get("codes"):
            rated = None
        object.__setattr__(self, "rated", rated)
        object.__setattr__(self, "codes", rated or held)
        shape, values = self.shape, self.codec.code_dim
        if len(shape) != 3 or shape[2] != values or 0 in shape:
            raise ValueError(f"codes are {shape}, expected (height, width, {values})")
        if self.dtype not in (np.float16, np.float32):
            raise ValueError(f"codes are {self.dtype}, expected float16 or float32")
        if self.wi.shape != self.wo.shape or self.wi.ndim != 2 or self.wi.shape[1] != 3:
            raise ValueError(f"directions are {self.wi.shape}, {self.wo.shape}, expected (n, 3)")

    @property
    def held(self) -> Any:
        """The codes, an array or :class:`RatedCodes`; given to a copy, it decodes nothing."""
        return vars(self)["codes"]

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the codes, which need not be decoded for it."""
        held = self.held
        if isinstance(held, RatedCodes):
            return held.height, held.width, len(held.center)
        return tuple(held.shape)

    @property
    def dtype(self) -> np.dtype[Any]:
        held = self.held
        return np.dtype(np.float32 if isinstance(held, RatedCodes) else held.dtype)

    def codes_of(self, chosen: Indices | slice) -> npt.NDArray[Any]:
        """Codes of some texels, numbered row by row, shape (n, code_dim); others need not be
        decoded.
        """
        held = self.held
        if isinstance(held, RatedCodes):
            return held.codes_of(chosen)
        found: npt.NDArray[Any] = held.reshape(-1, held.shape[2])[chosen]
        return found

    def expanded(self) -> LatentMap | None:
        """The map with coefficients for codes, or None: see
        :meth:`nacre.textures.codecs.TexelCodec.expanded`.
        """
        codec = self.codec.expanded()
        if codec is None:
            return None
        flat = self.codes.reshape(-1, self.codec.code_dim).astype(np.float32)
        codes = self.codec.coefficients(flat).reshape(*self.codes.shape[:2], -1)
        reference = self.reference and replace(self.reference, expanded=True)
        return replace(self, codes=codes, codec=codec, reference=reference)


LatentMap.codes = _Codes()  # type: ignore[assignment]  # would be a default inside the class


def check_decoded(values: Floats, where: str) -> Floats:
    """The values, which codes of a file or material decode to, if all are finite, else a
    FormatError.
    """
    if not np.isfinite(values).all():
        raise FormatError(f"{where}: some codes decode to values that are not finite")
    return values


class NeuralBtf(Btf):
    """The texture that codes stand for, decoded when values are needed.

    It is decoded at `directions`, pairs of shape (n, 3) each, or those of the source where None.
    Error messages start with `where`: a file's path.
    """

    decodable = True
    not_content = frozenset({"_where"})

    def __init__(
        self, latent: LatentMap, directions: tuple[Floats, Floats] | None = None, where: str = ""
    ) -> None:
        height, width, _ = latent.shape
        wi, wo = directions or (latent.wi, latent.wo)
        super().__init__(width, height, wi, wo, name=latent.name)
        self.latent, self._where = latent, where or latent.name

    def at_directions(self, wi: Floats, wo: Floats) -> NeuralBtf:
        return NeuralBtf(self.latent, (np.asarray(wi), np.asarray(wo)), self._where)

    def describe(self) -> dict[str, Any]:
        latent = self.latent
        reference = latent.reference
        facts = super().describe() | {
            "latent size": latent.codec.code_dim,
            "codes": f"{latent.rated.bytes_per_texel:.3g} bytes per texel"
            if latent.rated
            else str(latent.dtype),
            "model": f"in {reference.name}" if reference else "embedded",
        }
        errors = latent.metadata.get("errors", {})
        about = " (estimated)" if errors.get("estimated") else ""
        names = ("MSE x 1e4", "relative RMSE")
        return facts | {f"{name}{about}": errors[name] for name in names if name in errors}

    def texels(self, chosen: Indices | slice) -> Floats:
        codes = self.latent.codes_of(chosen).astype(np.float32, copy=False)
        return check_decoded(self._decode(codes), self._where)

    def images(self, chosen: Indices | slice) -> Floats:
        wi, wo = self.wi[chosen], self.wo[chosen]
        decode = on_all_cores(self.latent.codec, self.latent.codec.decoder(wi, wo))
        codes = self.latent.codes.reshape(self.texel_count, -1)
        pictures = np.empty((len(wi), self.texel_count, 3), np.float32)
        step = max(1, _BLOCK // (12 * max(len(wi), 1)))
        for start in range(0, self.texel_count, step):
            rows = slice(start, start + step)
            pictures[:, rows] = decode(codes[rows].astype(np.float32)).swapaxes(0, 1)
        shape = len(wi), self.height, self.width, 3
        return check_decoded(pictures.reshape(shape), self._where)

    @cached_property
    def _decode(self) -> TexelMap:
        return on_all_cores(self.latent.codec, self.latent.codec.decoder(self.wi, self.wo))
