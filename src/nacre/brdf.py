"""The interface that every reflectance shares."""

from __future__ import annotations

import abc
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.array import (
    Array,
    Colors,
    Components,
    Floats,
    Mask,
    Scalars,
    Spectra,
    SpectrumList,
    VectorList,
    Vectors,
    namespace,
)
from nacre.compile.pairs import check_unit, checked, compiled, in_chunks
from nacre.errors import NacreError
from nacre.geometry import broadcast_shape, cosine_hemisphere, join, split
from nacre.numerics.albedo import directional_albedo
from nacre.numerics.direction_samples import Scattered
from nacre.numerics.exchange import any_library, numbers
from nacre.objects.described import Described, readable_size
from nacre.objects.frozen import Frozen

COLOR = ("red", "green", "blue")
"""What the channels are unless something else is said; see :attr:`Brdf.channels`."""

_LARGEST = float(np.finfo(np.float32).max)
"""Bound of f_r in 1/sr: a file may hold finite numbers whose products are not."""


class Sampler(Frozen):
    """Draws `wi` for a given `wo`, with an exact density over solid angle.

    A subclass with a :attr:`kind` in :data:`nacre.sampling.SAMPLERS` can be kept in the file of a
    network; `docs/extending.md` says how another package adds one.
    """

    kind: ClassVar[str] = ""
    """Name of the kind in files and in the registry; empty where files cannot hold it."""

    adapted: ClassVar[bool] = True
    """Whether the density is made for a material; else fits and metrics use one that is."""

    @abc.abstractmethod
    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        """Directions `wi` and their densities from `u` in [0, 1); density 0 below the horizon."""

    @abc.abstractmethod
    def pdf_components(self, wi: Components, wo: Components) -> Array:
        """Density of `wi` in 1/sr given `wo`; both are above the horizon."""

    def describe(self) -> dict[str, Any]:
        """The kind, and the parameters of a dataclass, as JSON holds them; :meth:`from_description`
        makes the sampler again.
        """
        return {"kind": self.kind, **(asdict(self) if is_dataclass(self) else {})}

    @classmethod
    def parametrizations(cls) -> Mapping[str, Any]:
        """How networks predict samplers of this kind, by name in files.

        See :class:`nacre.sampling.parametrizations.Parametrization`.
        """
        return {}

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> Sampler:
        """The sampler that :meth:`describe` returned this description of.

        Raises KeyError, TypeError or ValueError if something is missing, of the wrong type, or out
        of bounds.
        """
        return cls(**{key: value for key, value in description.items() if key != "kind"})


class CosineSampler(Sampler):
    """Density cos(theta_i) / pi, whatever the view."""

    kind = "cosine"
    adapted = False

    def __str__(self) -> str:
        return "cosine"

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        wi = cosine_hemisphere(u[1], u[2])
        return wi, self.pdf_components(wi, wo)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        return wi[2] / math.pi + 0.0 * wo[2]


class Brdf(Described):
    """A reflectance: f_r(wi, wo) in 1/sr as linear Rec. 709 RGB, without the cosine.

    A subclass provides :meth:`eval_components`, a formula on components (see :mod:`nacre.array`),
    and gets NumPy evaluation, importance sampling, and rendering in Mitsuba from it.

    Objects do not change after they are made: :meth:`replaced` makes a copy with another name,
    source or sampler.

    Parameters
    ----------
    name
        Name of the material, for people; that of the class where empty.
    source
        Where the data came from: "file" and "sha256".
    sampler
        Where :meth:`sample` and :meth:`pdf` come from; that of the class where None.
    """

    isotropic: bool = True
    """Whether f_r is unchanged when both directions turn about the normal. A subclass's claim is
    tested before anything relies on it."""

    traceable: bool = True
    """Whether components may be arrays of any library, as rendering needs; else NumPy's only. Then
    :meth:`eval` may compile the formula, which is called once for that."""

    isotropy_known: ClassVar[bool] = False
    """Whether :attr:`isotropic` follows from the format or the formula, so that nobody tests it;
    see :func:`nacre.sampling.check_isotropic`."""

    physical: bool = False
    """Whether f_r is positive, and the same where light and view are swapped, by construction."""

    wavelengths: Floats | None = None
    """Bands in nm, increasing, where spectra are known: see :meth:`eval_spectral`; else None."""

    channels: tuple[str, str, str] = COLOR
    """What the three values of :meth:`eval` are: linear Rec. 709 red, green and blue, or, where the
    bands of a measurement make no color, one to three of these, longest first: "905 nm"."""

    notes: tuple[str, ...] = ()
    """What one should know about where f_r came from, in sentences: what its file holds besides,
    which factor its values were multiplied by. Fits and conversions keep them."""

    source: Mapping[str, str] | None = None
    """Where the data came from: "file" and "sha256"; :func:`nacre.load` sets it."""

    sampler: Sampler = CosineSampler()
    """Where :meth:`sample` and :meth:`pdf` come from."""

    by_design: ClassVar[Mapping[str, str]] = {}
    """Names of properties in :data:`nacre.soundness.PROPERTIES` that this kind of reflectance need
    not have, each with the reason."""

    def __init__(
        self,
        *,
        name: str = "",
        source: Mapping[str, str] | None = None,
        sampler: Sampler | None = None,
    ) -> None:
        # What is not given keeps the value of the class: subclasses may set defaults there.
        for key, value in (("name", name or None), ("source", source), ("sampler", sampler)):
            if value is not None:
                setattr(self, key, value)

    @abc.abstractmethod
    def eval_components(self, wi: Components, wo: Components) -> Components:
        """f_r in 1/sr on components of any array library.

        Called for directions on both sides of the horizon: the result there is ignored, but must
        not raise. May be negative where a measurement is; the callers clamp.
        """

    def valid_components(self, wi: Components, wo: Components) -> Array:
        """Whether f_r is known at a pair of directions above the horizon."""
        return wi[2] + 0.0 * wo[2] == wi[2]

    def scattered(self) -> Scattered | None:
        """The scattered samples that a fit should train on and be judged by.

        None where any pair of directions may be evaluated: the fit then draws its own.
        """
        return None

    def eval_bands(self, wi: VectorList, wo: VectorList) -> SpectrumList:
        """f_r in 1/sr per band, shape (n, bands), for directions of shape (n, 3), as
        :meth:`eval_spectral` needs it: results below the horizon are ignored there, and negative
        ones clamped.

        Raises NacreError if there are no spectra.
        """
        raise NacreError(f"{self.name or 'this material'}: is known in RGB only, not by wavelength")

    def in_bands(self, bands: Sequence[float] | str) -> Brdf:
        """A copy whose channels are other bands of its spectra.

        Parameters
        ----------
        bands
            One to three wavelengths in nm, each taken from the nearest band, the longest first; or
            "color", for linear Rec. 709.

        Raises
        ------
        NacreError
            If there are no spectra, or the bands of this kind of reflectance cannot be chosen, or
            none is near.
        """
        what = "its bands cannot be chosen" if self.wavelengths is not None else "it has none"
        raise NacreError(f"{self.name or 'this material'}: {what}; leave them out")

    @property
    def nbytes(self) -> int | None:
        """Bytes of the numbers that f_r comes from; None where it comes from no stored numbers.

        Each number counts once, with the bytes it takes in memory: float32 as a rule. What is
        computed from them or serves sampling only does not count, nor do the few numbers of fitted
        lobes.
        """
        return None

    def describe(self) -> dict[str, Any]:
        """Facts about this reflectance in the order they should be shown."""
        facts = {"name": self.name, "model": type(self).__name__, "isotropic": self.isotropic}
        if self.nbytes is not None:
            facts["memory bytes"] = self.nbytes
        if self.channels != COLOR:
            facts["channels"] = list(self.channels)
        if self.notes:
            facts["notes"] = list(self.notes)
        if self.wavelengths is None:
            return facts
        span = [float(self.wavelengths[0]), float(self.wavelengths[-1])]
        return facts | {"bands": len(self.wavelengths), "wavelengths nm": span}

    def summary(self) -> str:
        """Isotropy and size in a few words; :meth:`describe` has all facts."""
        isotropy = "isotropic" if self.isotropic else "anisotropic"
        return isotropy if self.nbytes is None else f"{isotropy}, {readable_size(self.nbytes)}"

    @any_library(on_device=True)
    def eval(self, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Colors:
        """f_r in 1/sr, linear RGB, without the cosine.

        For float32 it is compiled where :attr:`traceable`, and takes all cores from 100,000 pairs:
        a pair has the same bits wherever it stands in an array. NumPy evaluates float64.

        Parameters
        ----------
        wi, wo
            Unit directions to the light and to the viewer, shapes (..., 3) that broadcast. Where
            one is a PyTorch tensor or a JAX array, so is the result, on the same device and with
            gradients; lengths are checked on the CPU only, and not in traces. Arrays of other
            libraries (`__dlpack__`) are evaluated by NumPy or PyTorch and come back as theirs.

        Returns
        -------
        array of shape (..., 3)
            Non-negative; 0 where either direction is at or below the horizon. float64 if an input
            is an array of float64, else float32: numbers in lists count as float32.

        Raises
        ------
        ValueError
            If a direction is not a number, or not of unit length to
            :data:`nacre.compile.pairs.UNIT_TOLERANCE`.
        NacreError
            If gradients are wanted and this reflectance is not :attr:`traceable`.
        """
        if namespace(wi, wo).differentiable:
            tensor: Colors = self._eval_tensors(wi, wo)
            return tensor
        found = compiled(self, eval_formula, wi=wi, wo=wo) if self.traceable else None
        if found is not None:
            return found[0]
        wi, wo = checked(wi=wi, wo=wo)

        def values(wi: Floats, wo: Floats) -> Floats:
            light, view = split(wi), split(wo)
            return join(above_horizon(self.eval_components(light, view), light, view))

        return in_chunks(values, wi, wo, (3,))

    def _eval_tensors(self, wi: Any, wo: Any) -> Array:
        """What :meth:`eval` returns where a direction is an array of PyTorch or JAX."""
        xp = namespace(wi, wo)
        wi, wo = xp.matched(wi, wo)
        broadcast_shape(wi=wi, wo=wo)
        light, view = xp.peek(wi), xp.peek(wo)
        if light is not None and view is not None and not xp.follows(wi, wo):
            return xp.matched(wi, self.eval(light, view))[1]
        for name, w in (("wi", light), ("wo", view)):
            if w is not None:
                check_unit(name, w)
        if not self.traceable:
            raise NacreError(f"{self.name or 'this material'}: takes NumPy arrays only")
        return self._eval_followed(wi, wo)

    def _eval_followed(self, wi: Array, wo: Array) -> Array:
        """:meth:`eval` by operations of the arrays' own library, which it can follow."""
        xp, light, view = namespace(wi), split(wi), split(wo)
        visible = (light[2] > 0.0) & (view[2] > 0.0)
        # The hidden are evaluated at the normal: 0 times a gradient that is infinite is no number.
        up = 0.0, 0.0, 1.0
        a, b = (tuple(map(xp.where, [visible] * 3, w, up)) for w in (light, view))
        return join(above_horizon(self.eval_components(a, b), light, view))

    @any_library()
    def eval_spectral(self, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Spectra:
        """f_r in 1/sr at each of :attr:`wavelengths`, without the cosine, shape (..., bands).

        Between bands f_r is linear in the wavelength. :meth:`eval` is the color of these spectra,
        up to the difference between interpolating colors and spectra. Directions and values are
        otherwise as in :meth:`eval`.

        Raises NacreError if there are no spectra (:attr:`wavelengths` is None), ValueError if a
        direction is not of unit length.
        """
        wi, wo = checked(wi=wi, wo=wo)

        def values(wi: Floats, wo: Floats) -> Floats:
            visible = _visible(wi, wo)[:, None]
            return np.where(visible, np.maximum(self.eval_bands(wi, wo), 0.0), 0.0)

        bands = () if self.wavelengths is None else self.wavelengths.shape
        return in_chunks(values, wi, wo, bands)

    @any_library()
    def valid(self, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Mask:
        """Whether f_r is known, of shape (...): False below the horizon and where a measurement
        holds no valid sample. Raises ValueError as :meth:`eval` does.
        """
        found = compiled(self, _validity, wi=wi, wo=wo) if self.traceable else None
        if found is not None:
            return found[0] > 0.0
        wi, wo = checked(wi=wi, wo=wo)

        def values(wi: Floats, wo: Floats) -> Array:
            return _visible(wi, wo) & self.valid_components(split(wi), split(wo))

        return in_chunks(values, wi, wo, (), np.bool_)

    @any_library()
    def sample(
        self,
        wo: npt.ArrayLike,
        u: npt.ArrayLike | None = None,
        *,
        n: int | None = None,
        rng: np.random.Generator | int | None = None,
    ) -> tuple[Vectors, Scalars]:
        """Directions to the light drawn for given directions to the viewer, and their densities.

        Parameters
        ----------
        wo
            Unit directions, shape (..., 3).
        u
            Uniform numbers in [0, 1), shape (..., 3); drawn where None.
        n
            How many directions to draw for each `wo`, along a new first axis; one, without such an
            axis, where None.
        rng
            Draws `u`: a generator, or a seed; other numbers each time where None.

        Returns
        -------
        wi, pdf
            Unit directions, shape (..., 3), or (n, ..., 3), and densities in 1/sr, shape (...): 0
            where `wi` or `wo` is at or below the horizon.

        Raises
        ------
        ValueError
            If a direction is not of unit length, or a number of `u` is not in [0, 1).
        TypeError
            If `u` is given together with `n` or `rng`.
        """
        if u is None:
            wo = numbers(wo)
            shape = wo.shape if n is None else (n, *wo.shape)
            dtype = np.float64 if wo.dtype == np.float64 else np.float32
            u = np.random.default_rng(rng).random(shape, dtype)
        elif n is not None or rng is not None:
            raise TypeError("sample() takes the numbers u, or n and rng to draw them; not both")
        found = compiled(self.sampler, sample_formula, wo=wo, u=u)
        if found is not None:
            return found[0], found[1]
        wo, u = checked(wo=wo, u=u)
        wi, pdf = self.sampler.sample_components(split(wo), split(u))
        directions = join(wi).astype(wo.dtype, copy=False)
        return directions, np.where(_visible(directions, wo), pdf, 0.0).astype(wo.dtype)

    @any_library()
    def pdf(self, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Scalars:
        """Density in 1/sr with which :meth:`sample` draws `wi` for `wo`, shape (...).

        Raises ValueError as :meth:`eval` does.
        """
        found = compiled(self.sampler, pdf_formula, wi=wi, wo=wo)
        if found is not None:
            return found[0]
        wi, wo = checked(wi=wi, wo=wo)

        def values(wi: Floats, wo: Floats) -> Array:
            density = self.sampler.pdf_components(split(wi), split(wo))
            return np.where(_visible(wi, wo), density, 0.0)

        return in_chunks(values, wi, wo, ())

    @any_library()
    def albedo(self, wo: npt.ArrayLike = (0.0, 0.0, 1.0)) -> Colors:
        """Directional albedo: the part of the light that is reflected, for a reciprocal material.

        The integral of f_r cos(theta_i) over all `wi`, linear RGB without a unit, shape (..., 3),
        for unit `wo` of that shape; along the normal by default. It is taken at fixed points;
        :func:`nacre.metrics.albedo` estimates its error too. What is not known counts as 0.

        Raises ValueError if a direction is not of unit length.
        """
        return directional_albedo(self, wo)


def above_horizon(rgb: Components, wi: Components, wo: Components) -> Components:
    """Clamp colors to be non-negative, and to 0 where a direction is at or below the horizon.

    What overflows is clamped to the largest float32. This is :meth:`Brdf.eval`'s clamp, for
    components of any array library.
    """
    xp = namespace(*wi, *wo)
    visible = (wi[2] > 0.0) & (wo[2] > 0.0)
    red, green, blue = (
        xp.where(visible, xp.minimum(xp.maximum(c, 0.0), _LARGEST), 0.0) for c in rgb
    )
    return red, green, blue


# What is compiled: the values of `eval`, `valid`, `sample` and `pdf` on components.


def eval_formula(brdf: Brdf, wi: Components, wo: Components) -> tuple[Components]:
    return (above_horizon(brdf.eval_components(wi, wo), wi, wo),)


def _validity(brdf: Brdf, wi: Components, wo: Components) -> tuple[Array]:
    one = namespace(*wi, *wo).where(brdf.valid_components(wi, wo), 1.0, 0.0)
    return (_where_visible(one, wi, wo),)


def sample_formula(sampler: Sampler, wo: Components, u: Components) -> tuple[Components, Array]:
    wi, pdf = sampler.sample_components(wo, u)
    return wi, _where_visible(pdf, wi, wo)


def pdf_formula(sampler: Sampler, wi: Components, wo: Components) -> tuple[Array]:
    return (_where_visible(sampler.pdf_components(wi, wo), wi, wo),)


def _where_visible(values: Array, wi: Components, wo: Components) -> Array:
    return namespace(*wi, *wo).where((wi[2] > 0.0) & (wo[2] > 0.0), values, 0.0)


def _visible(wi: Floats, wo: Floats) -> Mask:
    return (wi[..., 2] > 0) & (wo[..., 2] > 0)


def expect_brdf(value: object, function: str) -> None:
    """Raise a TypeError that says what to do where a function was given no reflectance."""
    if isinstance(value, Brdf):
        return
    if isinstance(value, str | os.PathLike):
        hint = f"give it nacre.load({os.fspath(value)!r})"
        raise TypeError(f"{function} takes a reflectance, got a path: {hint}")
    raise TypeError(f"{function} takes a reflectance (nacre.Brdf), got {type(value).__name__}")
