"""Spectral networks: f_r in every band of a spectrum from a few numbers, which a network gives.

A network of the directions has k outputs x, and f_r at a wavelength is the sum over them of (e^x -
1) s(wavelength), with k spectra s of the material. Each e^x - 1 is what the material reflects in a
broad band; the spectra, which may be negative, rebuild the narrow bands from these. A color, or a
band, is such a sum as well, so that the network has one more layer for its three channels, and does
in RGB whatever a chain of layers does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Floats, Table, namespace
from nacre.brdf import COLOR, Sampler
from nacre.errors import NacreError
from nacre.geometry import split
from nacre.io.tensors import PRECISIONS, Tensors
from nacre.neural.chain import ChainBrdf
from nacre.neural.chain_file import numbered_tensors
from nacre.neural.nbrdf import SINGLE
from nacre.neural.network import fit_facts, loss_text
from nacre.numerics.mlp import Layer
from nacre.spectra import as_channels, chosen_channels

LAST = "exp"  # what follows the layer of coefficients
MOST_COEFFICIENTS = 32  # of a file, whose sums then stay finite
_LARGEST = 1e38  # of f_r in 1/sr, which float32 holds
_TINY = 1e-6  # nm: keeps a wavelength beyond the last band from dividing by 0


class SpectralBrdf(ChainBrdf):
    """A reflectance by wavelength, from coefficients of a network.

    Parameters
    ----------
    layers, activations
        Dense layers from the inputs to k outputs x, and what follows each; the last is "exp".
    spectra
        What multiplies e^x - 1 in each band, shape (k, bands).
    wavelengths
        The bands in nm, shape (bands,), increasing. Between them f_r is linear in the wavelength,
        and beyond them constant.
    inputs, isotropic, name, source, sampler
        See :class:`nacre.neural.chain.ChainBrdf`.
    metadata
        JSON-able facts about the fit and its source, kept in the file.
    precision
        How a file stores weights and spectra, "single" or "half", which must hold them exactly;
        biases are single, since dark f_r is a small difference of large ones.

    Raises
    ------
    ValueError
        If layers, spectra and wavelengths do not fit together, a number is not finite, or the
        precision does not hold them.
    """

    isotropy_known = True

    def __init__(
        self,
        layers: Sequence[Layer],
        activations: Sequence[str],
        spectra: npt.ArrayLike,
        wavelengths: npt.ArrayLike,
        *,
        inputs: str = "enhanced",
        isotropic: bool | None = None,
        name: str = "",
        source: Mapping[str, str] | None = None,
        sampler: Sampler | None = None,
        metadata: Mapping[str, Any] | None = None,
        precision: str = SINGLE,
    ) -> None:
        bands, table = np.array(wavelengths, np.float64), np.array(spectra, np.float32)
        count = len(layers[-1].biases) if layers else 0
        if bands.ndim != 1 or not len(bands) or table.shape != (count, len(bands)):
            raise ValueError(f"spectra of shape {table.shape}, expected ({count}, {bands.size})")
        fine = np.isfinite(bands).all() and bands[0] > 0.0 and (np.diff(bands) > 0.0).all()
        if not fine or not np.isfinite(table).all():
            raise ValueError("wavelengths do not increase from above 0, or spectra are not finite")
        if not activations or activations[-1] != LAST:
            raise ValueError(f"{LAST!r} must follow the layer of coefficients")
        channels, names = as_channels(np.eye(len(bands)), bands)
        super().__init__(
            [*layers, _mixing(table, channels)],
            [*activations, ""],
            inputs=inputs,
            isotropic=isotropic,
            name=name,
            source=source,
            sampler=sampler,
        )
        self.cooperative = False  # renderers need the coefficients, not the channels alone
        self.wavelengths, self.channels = bands, names
        self.spectra, self._bands = Table(table), Table(bands)
        self.metadata: Mapping[str, Any] = dict(metadata or {})
        self.precision = precision
        exact = zip(self.numbers.values(), self.stored.values(), strict=True)
        if not all(np.array_equal(array, kept) for array, kept in exact):
            raise ValueError(f"{precision} precision does not hold these numbers")

    @property
    def coefficient_layers(self) -> tuple[Layer, ...]:
        """The layers from the inputs to the coefficients."""
        return tuple(self.layers[:-1])

    @property
    def numbers(self) -> Tensors:
        """Weights and biases of every layer, numbered from 1, and the spectra, all float32."""
        return numbered_tensors(self.coefficient_layers) | {"spectra": self.spectra.values}

    @property
    def stored(self) -> Tensors:
        """:attr:`numbers` as files store them."""
        kind = PRECISIONS[self.precision]
        return {
            name: array if name.startswith("biases") else array.astype(kind)
            for name, array in self.numbers.items()
        }

    @property
    def weight_count(self) -> int:
        """How many numbers there are."""
        return sum(array.size for array in self.numbers.values())

    @property
    def nbytes(self) -> int:
        return sum(array.nbytes for array in self.stored.values())

    def color(self) -> ChainBrdf:
        """The same network in its three channels, without the spectra: f_r is the same."""
        made = ChainBrdf(
            self.layers,
            self.activations,
            inputs=self.inputs,
            isotropic=self.isotropic,
            name=self.name,
            source=self.source,
            sampler=self.sampler,
        )
        return made.replaced(channels=self.channels, notes=self.notes)

    def with_layers(self, layers: Sequence[Layer]) -> ChainBrdf:
        """A network in the same channels with other weights, which has no spectra."""
        return self.color().with_layers(layers)

    def in_bands(self, bands: Sequence[float] | str) -> SpectralBrdf:
        assert self.wavelengths is not None
        try:
            weights, names = chosen_channels(np.eye(len(self.wavelengths)), self.wavelengths, bands)
        except ValueError as error:
            raise NacreError(f"{self.name or 'this material'}: {error}") from error
        mixed = _mixing(self.spectra.values, weights)
        return self.replaced(layers=(*self.coefficient_layers, mixed), channels=names)

    def in_channels(self, names: Sequence[str]) -> SpectralBrdf:
        """A copy whose channels have such names; see :attr:`nacre.Brdf.channels`.

        Raises ValueError if they are none that :meth:`in_bands` gives.
        """
        if tuple(names) == self.channels:
            return self
        if tuple(names) == COLOR:
            return self.in_bands("color")
        return self.in_bands([float(name.removesuffix(" nm")) for name in dict.fromkeys(names)])

    def coefficients(self, wi: Components, wo: Components) -> list[Array]:
        """e^x for each of the k outputs, on components of any array library."""
        inputs = self.input_components(wi, wo)
        return list(self.through(inputs, self.coefficient_layers))

    def eval_bands(self, wi: Floats, wo: Floats) -> Floats:
        e = np.stack(self.coefficients(split(wi), split(wo)), axis=-1).astype(np.float64)
        return np.clip((e - 1.0) @ self.spectra.values, -_LARGEST, _LARGEST)

    def at_wavelength(self, coefficients: Sequence[Array], wavelength: Array) -> Array:
        """f_r in 1/sr at a wavelength in nm, from :meth:`coefficients`.

        Linear between bands, where negative f_r counts as 0, as :meth:`nacre.Brdf.eval_spectral`
        has it.
        """
        xp, count = namespace(wavelength, *coefficients), len(self._bands.values)
        below = xp.to_index(0.0 * wavelength)
        for step in (1 << k for k in reversed(range(count.bit_length()))):
            further = xp.minimum(below + step, count - 1)
            below = xp.where(xp.take(self._bands, further) <= wavelength, further, below)
        above = xp.minimum(below + 1, count - 1)
        low, high = (xp.take(self._bands, band) for band in (below, above))
        part = (wavelength - low) / xp.maximum(high - low, _TINY)
        part = xp.minimum(xp.maximum(part, 0.0), 1.0)
        value, end = (self._in_band(coefficients, band) for band in (below, above))
        return value + part * (end - value)

    def _in_band(self, coefficients: Sequence[Array], band: Array) -> Array:
        xp, count = namespace(band, *coefficients), self.spectra.values.shape[1]
        value: Array = 0.0
        for row, e in enumerate(coefficients):
            value = value + (e - 1.0) * xp.take(self.spectra, band + row * count)
        return xp.maximum(value, 0.0)

    def loss_text(self) -> str:
        """See :func:`nacre.neural.network.loss_text`."""
        return loss_text(self.metadata)

    def describe(self) -> dict[str, Any]:
        own = {
            "layers": "-".join(map(str, self.sizes[:-1])),
            "coefficients": len(self.spectra.values),
            "weights": self.weight_count,
        }
        return super().describe() | fit_facts(self.metadata, own)

    def summary(self) -> str:
        assert self.wavelengths is not None
        return f"{len(self.wavelengths)} bands, {super().summary()}"


def _mixing(spectra: Floats, weights: Floats) -> Layer:
    """The layer from e^x to channels that are sums of bands, with weights (bands, 3)."""
    mixed = spectra.astype(np.float64) @ weights
    return Layer(mixed.astype(np.float32), -mixed.sum(axis=0).astype(np.float32))
