"""The interface that every texture of measured reflectance shares."""

from __future__ import annotations

import abc
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.objects.described import Described

Indices = npt.NDArray[np.integer[Any]]


class Btf(Described):
    """A grid of texels, each an apparent BRDF known at the same pairs of directions.

    Values are reflectance factors, pi f_r, as linear Rec. 709 RGB without the cosine: 1 is a
    perfectly white diffuse surface. They may be read from a file on demand, so ask for many at
    once. Texel `y * width + x` lies in row y from the top, column x. `wi` and `wo` are unit
    directions to the light and to the viewer, shape (n, 3), float32 as all arrays here. Objects do
    not change after they are made: :meth:`replaced` makes a copy with another name or source
    ("file" and "sha256"; see :class:`nacre.io.source.Source`).
    """

    by_image: bool = False
    """Whether :meth:`texels` has to read every picture;
    :func:`nacre.measured.textures.transposition.transposed` then makes the same texture with texels
    that are read at once."""
    files: Sequence[Path] = ()
    """Pictures that it is read from; none where it lies in one file or in memory."""
    decodable: bool = False
    """Whether :meth:`at_directions` returns the texture at any pairs of directions."""
    latent: Any = None
    """Codes and their codec, a :class:`nacre.textures.LatentMap`, for an encoded texture; else
    None."""

    def __init__(
        self,
        width: int,
        height: int,
        wi: Floats,
        wo: Floats,
        *,
        name: str = "",
        source: Mapping[str, str] | None = None,
    ) -> None:
        self.width, self.height, self.wi, self.wo = width, height, wi, wo
        self.name, self.source = name, source

    def at_directions(self, wi: Floats, wo: Floats) -> Btf:
        """The same texture at other pairs of unit directions, shape (n, 3), if it is
        :attr:`decodable`.

        Raises NacreError if it is known at its own directions only.
        """
        raise NacreError(
            f"{self.name}: is known at its own {self.pair_count:,} pairs of directions only; "
            "encode it, and decode it at others"
        )

    @abc.abstractmethod
    def texels(self, chosen: Indices | slice) -> Floats:
        """Values of some texels at every pair of directions, shape (len(chosen), n, 3)."""

    def kept_texels(self, chosen: slice) -> npt.NDArray[Any]:
        """:meth:`texels` in half precision and without a copy where they lie so, for reading."""
        return self.texels(chosen)

    def texels_at(self, chosen: Indices, pairs: Indices) -> Floats:
        """Values of some texels at some pairs of directions, shape (len(chosen), len(pairs), 3)."""
        return self.texels(chosen)[:, pairs]

    @abc.abstractmethod
    def images(self, chosen: Indices | slice) -> Floats:
        """Pictures at some pairs of directions, shape (len(chosen), height, width, 3)."""

    @property
    def texel_count(self) -> int:
        return self.width * self.height

    @property
    def pair_count(self) -> int:
        return len(self.wi)

    def summary(self) -> str:
        """Size in a few words; :meth:`describe` has all facts."""
        return f"{self.width} x {self.height} texels, {self.pair_count} pairs of directions"

    def describe(self) -> dict[str, Any]:
        """Facts about this texture in the order they should be shown; angles are in degrees."""
        directions = (self.wi, self.wo)
        lights, views = (len(np.unique(w.round(5), axis=0)) for w in directions)
        polar = [float(np.degrees(np.arccos(np.clip(w[:, 2].min(), -1, 1)))) for w in directions]
        pairs = np.concatenate([self.wi, self.wo], axis=1).round(5)
        repeated = self.pair_count - len(np.unique(pairs, axis=0))
        return {
            "name": self.name,
            "width": self.width,
            "height": self.height,
            "pairs of directions": self.pair_count,
            **({"pairs that repeat others": repeated} if repeated else {}),
            "lights": lights,
            "views": views,
            "largest polar angle of lights": polar[0],
            "largest polar angle of views": polar[1],
            "bytes as half floats": 6 * self.texel_count * self.pair_count,
        }

    def blocks(
        self, size_limit: int = 1 << 25, start: int = 0, stop: int | None = None
    ) -> Iterator[slice]:
        """Runs of texels, in order, whose values take at most `size_limit` bytes each.

        They go from `start` to before `stop`: of all, or of as many as were chosen.
        """
        step = max(1, size_limit // (12 * self.pair_count))
        stop = self.texel_count if stop is None else stop
        for first in range(start, stop, step):
            yield slice(first, min(first + step, stop))


class TableBtf(Btf):
    """A texture whose values lie in one array, which may be mapped from a file.

    `values` are reflectance factors, shape (height, width, n, 3), of any type of floats; `wi` and
    `wo` unit directions, shape (n, 3).
    """

    def __init__(self, values: npt.NDArray[Any], wi: Floats, wo: Floats, name: str = "") -> None:
        if values.ndim != 4 or values.shape[2:] != (len(wi), 3) or wi.shape != wo.shape:
            raise ValueError(f"values {values.shape} do not fit {len(wi)}, {len(wo)} directions")
        super().__init__(values.shape[1], values.shape[0], wi, wo, name=name)
        self.values = values

    def describe(self) -> dict[str, Any]:
        return super().describe() | {"values": str(self.values.dtype)}

    def texels(self, chosen: Indices | slice) -> Floats:
        flat = self.values.reshape(self.texel_count, self.pair_count, 3)
        return np.asarray(flat[chosen], np.float32)

    def kept_texels(self, chosen: slice) -> npt.NDArray[Any]:
        if self.values.dtype != np.float16 or not self.values.flags.c_contiguous:
            return self.texels(chosen)
        found = self.values.reshape(self.texel_count, self.pair_count, 3)[chosen].view()
        found.flags.writeable = False
        return found

    def texels_at(self, chosen: Indices, pairs: Indices) -> Floats:
        flat = self.values.reshape(self.texel_count, self.pair_count, 3)
        return np.asarray(flat[chosen[:, None], pairs], np.float32)

    def images(self, chosen: Indices | slice) -> Floats:
        return np.ascontiguousarray(np.moveaxis(self.values[:, :, chosen], 2, 0), dtype=np.float32)
