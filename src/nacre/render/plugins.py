"""Mitsuba BSDFs of reflectances: the plugins `nbrdf` and `brdf`; and all plugins made known.

Directions are swapped here: Mitsuba's `si.wi`, which points to the viewer, is our `wo`,
and its `wo` is our `wi`. Where Mitsuba follows light instead of sight it is the other way round,
which matters for a measurement that is not reciprocal.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from nacre.array import Components
from nacre.brdf import Brdf, above_horizon
from nacre.errors import FormatError, NacreError, require
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.prune import without_inactive_units
from nacre.render import adapter, llvm
from nacre.render.engine import check_llvm, mitsuba
from nacre.render.network import CooperativeNetwork
from nacre.render.textures.plugins import plugins as btf_plugins
from nacre.render.textures.plugins import texture_bsdf
from nacre.sampling import check_isotropic
from nacre.textures.uniform import TexelBrdf


def register() -> None:
    """Make the plugins `nbrdf`, `brdf`, `neuralbtf` and `measuredbtf` known to Mitsuba.

    For the current variant, if one is set, and for every variant set from now on. Calling it again
    is harmless. The first two take `filename`, a file that :func:`nacre.load` reads; `nbrdf` wants
    a network in it and has two more properties: see :func:`bsdf`. The others take a texture, that
    of `neuralbtf` encoded: see :func:`nacre.render.textures.plugins.texture_bsdf`.

    Raises
    ------
    MissingExtraError
        If Mitsuba is not installed.
    LLVMError
        If the current variant compiles with LLVM and there is none of release 17 or newer.

    Examples
    --------
    >>> import nacre
    >>> nacre.render.register()
    >>> mi = nacre.render.mitsuba()  # from here on: {"type": "nbrdf", "filename": ...}
    """
    llvm.prepare()
    mi = require("mitsuba", "render")
    mi.detail.add_variant_callback(_register_variant)
    if mi.variant() is not None:
        _register_variant(None, mi.variant())


def bsdf(brdf: Brdf, weights: str = "literals", precision: str = "single") -> Any:
    """A Mitsuba BSDF of a reflectance in memory, to put into scene dictionaries.

    Sets :data:`nacre.render.engine.DEFAULT_VARIANT` if no variant is set.

    Parameters
    ----------
    brdf
        Any reflectance.
    weights
        How a network's weights enter the renderer. `"literals"` compiles them into the kernel: the
        fastest rendering of small networks, recompiled for every material. `"cooperative"` keeps
        them in a buffer on Dr.Jit's cooperative vectors, which :func:`mitsuba.traverse` shows as
        the differentiable parameter `weights`: for optimization and for large networks.
    precision
        `"single"` or, for cooperative weights, `"half"`.

    Returns
    -------
    mi.BSDF
        With a method `material()` that returns the reflectance, with its current weights; of a
        texel of a texture the plugin `neuralbtf`, without it.

    Raises
    ------
    NacreError
        If an option is unknown or does not apply, or `brdf` is not traceable.
    """
    mi = mitsuba()
    check_isotropic(brdf)
    neural = isinstance(brdf, NeuralBrdf)
    if not neural and (weights, precision) != ("literals", "single"):
        raise NacreError(f"weights and precision are for networks, not {type(brdf).__name__}")
    if isinstance(brdf, TexelBrdf):
        # Rows of a texture run down: turned over, its axes are those of the surface.
        upright = mi.ScalarTransform4f().scale([1.0, -1.0, 1.0])
        return texture_bsdf(brdf.latent(), interpolation="linear", to_uv=upright)
    properties = mi.Properties("nbrdf" if neural else "brdf")
    if neural:
        properties["weights"], properties["precision"] = weights, precision
    return _plugins(mi.variant())[properties.plugin_name()](properties, brdf)


def _register_variant(_: str | None, variant: str) -> None:
    mi = require("mitsuba", "render")
    if variant.startswith("llvm"):
        check_llvm()
    for name, plugin in (_plugins(variant) | btf_plugins(variant)).items():
        mi.register_bsdf(name, plugin)


def _read(mi: Any, properties: Any) -> Brdf:
    from nacre.formats import load_brdf

    if "filename" not in properties:
        raise FormatError(f"{properties.plugin_name()}: give it the property 'filename'")
    brdf: Brdf = load_brdf(str(mi.file_resolver().resolve(properties["filename"])))
    return brdf


@cache
def _plugins(variant: str) -> dict[str, Any]:
    """The plugin classes of the variant that is set, by name."""
    mi: Any = require("mitsuba", "render")
    dr: Any = require("drjit", "render")

    class Reflectance(mi.BSDF):  # type: ignore[misc]
        """The plugin `brdf`."""

        def __init__(self, properties: Any, brdf: Brdf | None = None) -> None:
            self.brdf = _read(mi, properties) if brdf is None else brdf
            if not self.brdf.traceable:
                raise NacreError(
                    f"{self.brdf.name or 'this material'}: {type(self.brdf).__name__} cannot be "
                    "rendered as it is; fit a network to it first (nacre fit)"
                )
            self.albedo: Components | None = None
            self.prepare(properties)
            super().__init__(properties)  # from here on, all renderings call it
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
            if not self.brdf.isotropic:
                flags |= mi.BSDFFlags.Anisotropic
            self.m_components = [flags]
            self.m_flags = flags

        def prepare(self, properties: Any) -> None:
            """What subclasses make before renderings may call them."""

        def material(self) -> Brdf:
            """The reflectance."""
            return self.brdf

        def f_r(self, wi: Components, wo: Components) -> Components:
            """What the reflectance evaluates, on components of the variant."""
            return self.brdf.eval_components(wi, wo)

        def value(self, ctx: Any, si: Any, given: Any, other: Any, active: Any) -> Any:
            """Spectrum of f_r times the cosine of `other`."""
            follows_light = ctx.mode == mi.TransportMode.Importance
            wi, wo = (given, other) if follows_light else (other, given)
            rgb = above_horizon(self.f_r(wi, wo), wi, wo)
            red, green, blue = (c * other[2] for c in rgb)
            return adapter.spectrum(mi, (red, green, blue), si.wavelengths, active)

        def sample(
            self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True
        ) -> tuple[Any, Any]:
            if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
            given: Any = adapter.components(*si.wi)
            u: Any = adapter.components(sample1, *sample2)
            with np.errstate(all="ignore"):
                other, density = self.brdf.sampler.sample_components(given, u)
                active = active & (given[2] > 0) & (other[2] > 0) & (density > 0)
                value = self.value(ctx, si, given, other, active)
                inverse = adapter.masked(mi, 1.0 / density, active)
            return adapter.glossy_sample(mi, other, density, active), value * inverse

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                return mi.Spectrum(0.0), mi.Float(0.0)
            given: Any = adapter.components(*si.wi)
            other: Any = adapter.components(*wo)
            active = active & (given[2] > 0) & (other[2] > 0)
            with np.errstate(all="ignore"):
                density = self.brdf.sampler.pdf_components(other, given)
                value = self.value(ctx, si, given, other, active)
            return value, adapter.masked(mi, density, active)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            # What the density alone needs is never compiled.
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            """Share of light along the normal that is reflected, with the weights as loaded."""
            if self.albedo is None:
                red, green, blue = adapter.albedo(self.brdf).tolist()
                self.albedo = red, green, blue
            return adapter.spectrum(mi, self.albedo, si.wavelengths, active)

        def to_string(self) -> str:
            facts = self.describe() | {"sampler": self.brdf.sampler}
            lines = "".join(f"  {name} = {value},\n" for name, value in facts.items())
            return f"{type(self).__name__}[\n{lines}]"

        def describe(self) -> dict[str, Any]:
            """Facts that :meth:`to_string` shows."""
            return self.brdf.describe()

    class Network(Reflectance):
        """The plugin `nbrdf`."""

        def prepare(self, properties: Any) -> None:
            if not isinstance(self.brdf, NeuralBrdf):
                raise NacreError(
                    f"nbrdf renders networks; for {type(self.brdf).__name__} use the plugin brdf"
                )
            self.mode = str(properties.get("weights", "literals"))
            precision = str(properties.get("precision", "single"))
            if self.mode not in ("literals", "cooperative") or precision not in ("single", "half"):
                raise NacreError(
                    "nbrdf: weights are 'literals' or 'cooperative', precision 'single' or 'half'; "
                    f"got {self.mode!r} and {precision!r}"
                )
            self.network: CooperativeNetwork | None = None
            if self.mode == "cooperative":
                if mi.Float is float:
                    raise NacreError(
                        f"nbrdf: cooperative weights need a JIT variant, got {variant}"
                    )
                self.network = CooperativeNetwork(self.brdf, mi, precision == "half")
                self.weights = self.network.initial()
            elif precision == "half":
                raise NacreError("nbrdf: half precision is for cooperative weights")
            else:
                self.traced = without_inactive_units(self.brdf)

        def material(self) -> Brdf:
            """The network with its current weights."""
            if self.network is None:
                return self.brdf
            layers = self.network.layers(self.weights)
            return self.brdf.with_layers(layers)  # type: ignore[attr-defined, no-any-return]

        def f_r(self, wi: Components, wo: Components) -> Components:
            if self.network is None:
                return self.traced.eval_components(wi, wo)
            return self.network.eval_components(self.weights, wi, wo)

        def traverse(self, callback: Any) -> None:
            if self.network is not None:
                callback.put("weights", self.weights, mi.ParamFlags.Differentiable)

        def describe(self) -> dict[str, Any]:
            return self.brdf.describe() | {"weights": self.mode}

    return {"brdf": Reflectance, "nbrdf": Network}
