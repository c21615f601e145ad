"""Mitsuba BSDFs of textures: the plugins `neuralbtf` and `measuredbtf`.

Directions are swapped here as in :mod:`nacre.render.plugins`.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Components, Floats
from nacre.brdf import above_horizon
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError, require
from nacre.render import adapter
from nacre.render.engine import mitsuba
from nacre.render.textures.decoders import HIT_DECODERS, HitDecoder, TableDecoder
from nacre.render.textures.factors import CHROMAS, GREYS, factor
from nacre.render.textures.lobes import latent_lobes, table_lobes
from nacre.render.textures.measured import MeasuredDecoder, Sides
from nacre.render.textures.pixel_footprint import footprint
from nacre.render.textures.placement import Placement
from nacre.render.textures.relief import Relief, read_heights
from nacre.render.textures.texels import INTERPOLATIONS, Records, TexelGrid, record_bytes
from nacre.runtime.progress import Progress, silent
from nacre.sampling.tilted import TiltedMixture
from nacre.textures.latent_file import load_latent_map
from nacre.textures.latent_map import LatentMap
from nacre.textures.mipmap import LatentPyramid, level_shapes

DECODERS = "table", "network"
COEFFICIENTS = "auto", "texture", "hit"
RESOLUTION = 20
"""Of the grid of directions; see :mod:`nacre.render.textures.angle_grid`."""
MEMORY = 2048
"""MiB that the data of a texture may take."""


def texture_bsdf(source: LatentMap | Btf, progress: Progress = silent, **options: Any) -> Any:
    """A Mitsuba BSDF of a texture in memory, to put into scene dictionaries.

    Sets :data:`nacre.render.engine.DEFAULT_VARIANT` if no variant is set.

    Parameters
    ----------
    source
        An encoded texture, for `neuralbtf`; or any other, for `measuredbtf`.
    progress
        Called while functions are tabulated.
    options
        Properties of the plugin:

        - `interpolation`: see :data:`nacre.render.textures.texels.Interpolation`; of directions
        too,
          where "nearest" is "linear".
        - `pixel_angle`: degrees between neighboring pixels of the camera. Given, a hit shows
          what a pixel sees of an encoded texture, from afar and at grazing angles: means of
          reflectance, of a pyramid of levels that takes a third more memory. Mitsuba's paths
          carry no ray differentials that would tell it.
        - `to_uv`: as Mitsuba's `bitmap` has it.
        - `height_field`: a gray image for parallax, and `depth`: widths of the texture from black
          to white.
        - `memory`: MiB that the data may take, :data:`MEMORY` unless given.

        and of `neuralbtf`:

        - `decoder`: "table", functions of the texture's own on a grid of directions
          (:mod:`nacre.render.textures.factors`), or "network", the codec's own networks at every
          hit.
        - `resolution`: of that grid, :data:`RESOLUTION` unless given.
        - `coefficients`: of the default codec's networks, in memory for each "texture", or found
          at each "hit"; "auto" is "texture" where memory is enough.
        - `precision`: of the networks, "single" or "half".

    Raises
    ------
    NacreError
        If an option is unknown or out of range, the variant does not compile, the texture needs
        more memory than is allowed, or its codec knows its own directions only.
    """
    mi = mitsuba()
    name = "neuralbtf" if isinstance(source, LatentMap) else "measuredbtf"
    properties = mi.Properties(name)
    for key, value in options.items():
        properties[key] = value
    return plugins(mi.variant())[name](properties, source, progress)


@cache
def plugins(variant: str) -> dict[str, Any]:
    """The plugin classes of the variant that is set, by name."""
    mi: Any = require("mitsuba", "render")
    dr: Any = require("drjit", "render")

    class Texture(mi.BSDF):  # type: ignore[misc]
        """What both plugins share; subclasses make the decoder and the lobes."""

        decoder: HitDecoder
        wavefront = False
        """Whether it costs far more than tracing; see :func:`nacre.render.passes.wavefronts`."""

        def __init__(
            self,
            properties: Any,
            source: LatentMap | Btf | None = None,
            progress: Progress = silent,
        ) -> None:
            name = properties.plugin_name()
            if mi.Float is float:
                raise NacreError(f"{name}: needs a variant that compiles, got {variant}")
            self.interpolation = _choice(properties, "interpolation", INTERPOLATIONS)
            self.memory = int(_number(properties, "memory", MEMORY, 1.0)) << 20
            self.pixel_angle = math.radians(_number(properties, "pixel_angle", 0.0, 0.0))
            self.placement = Placement(mi, properties.get("to_uv"))
            height_field, depth = properties.get("height_field"), properties.get("depth")
            if (height_field is None) != (depth is None):
                raise NacreError(f"{name}: height_field and depth belong together; give both")
            self.stochastic = self.interpolation == "stochastic"
            path = _path(mi, properties) if source is None else None
            self.height, self.width, lobes = self.prepare(properties, path, source, progress)
            levels = level_shapes(self.height, self.width) if self.pixel_angle else None
            self.grid = TexelGrid(mi, self.height, self.width, self.interpolation, levels)
            self.lobe_grid = TexelGrid(mi, len(lobes), lobes.shape[1], self.interpolation)
            self.lobes = Records(mi, lobes.reshape(-1, lobes.shape[2]), half=True)
            self.relief: Relief | None = None
            if height_field is not None:
                heights = read_heights(_resolved(mi, height_field))
                depth = _number(properties, "depth", 0.0, 0.0)
                self.relief = Relief(mi, heights, depth, self.width / self.height)
            super().__init__(properties)  # from here on, all renderings call it
            glossy = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
            flags = glossy | mi.BSDFFlags.SpatiallyVarying | mi.BSDFFlags.Anisotropic
            self.m_components = [flags]
            self.m_flags = flags

        def prepare(
            self, properties: Any, path: Path | None, source: Any, progress: Progress
        ) -> tuple[int, int, Floats]:
            """Make the decoder; height and width of the map, and its lobes."""
            raise NotImplementedError

        def at(self, si: Any, given: Components) -> tuple[Any, TiltedMixture]:
            """What the decoder needs of the texels at hits, and what they are sampled by."""
            uv = self.placement.uv(si)
            if self.relief is not None:
                uv = self.relief.seen(uv, given)
            share, roughness, x, y = self.lobes.at(self.lobe_grid.around(uv))
            mixture = TiltedMixture(share, roughness, (x, y))
            if not self.pixel_angle:
                return self.decoder.texels(self.grid.around(uv)), mixture
            seen = footprint(mi, si, self.placement, self.pixel_angle, self.height, self.width)
            return self.decoder.texels(self.grid.seen(uv, seen)), mixture

        def value(self, ctx: Any, si: Any, texels: Any, given: Any, other: Any, active: Any) -> Any:
            """Spectrum of f_r times the cosine of `other`, both in the frame of the texture."""
            follows_light = ctx.mode == mi.TransportMode.Importance
            wi, wo = (given, other) if follows_light else (other, given)
            rgb = above_horizon(self.decoder.reflectance(texels, wi, wo), wi, wo)
            red, green, blue = (c * (other[2] * (1.0 / math.pi)) for c in rgb)
            return adapter.spectrum(mi, (red, green, blue), si.wavelengths, active)

        def sample(
            self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True
        ) -> tuple[Any, Any]:
            if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
            given = self.placement.to_texture(si, tuple(si.wi))
            texels, mixture = self.at(si, given)
            other, density = mixture.sample_components(given, (sample1, *sample2))
            active = active & (given[2] > 0) & (other[2] > 0) & (density > 0)
            value = self.value(ctx, si, texels, given, other, active)
            towards = self.placement.from_texture(si, other)
            bs = adapter.glossy_sample(mi, towards, density, active)
            return bs, value * ((1.0 / density) & active)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                return mi.Spectrum(0.0), mi.Float(0.0)
            given, other = (self.placement.to_texture(si, tuple(w)) for w in (si.wi, wo))
            active = active & (given[2] > 0) & (other[2] > 0)
            texels, mixture = self.at(si, given)
            value = self.value(ctx, si, texels, given, other, active)
            return value, mixture.pdf_components(other, given) & active

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            # What the density alone needs is never compiled.
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def to_string(self) -> str:
            lines = "".join(f"  {name} = {value},\n" for name, value in self.describe().items())
            return f"{type(self).__name__}[\n{lines}]"

        def describe(self) -> dict[str, Any]:
            """Facts that :meth:`to_string` shows."""
            return {
                "width": self.width,
                "height": self.height,
                "interpolation": self.interpolation,
                "decoder": type(self.decoder).__name__,
            }

    class NeuralTexture(Texture):
        """The plugin `neuralbtf`."""

        def prepare(
            self, properties: Any, path: Path | None, source: Any, progress: Progress
        ) -> tuple[int, int, Floats]:
            latent: LatentMap = load_latent_map(path) if path is not None else source
            codec, codes = latent.codec, latent.codes
            if not codec.any_directions:
                raise NacreError(
                    f"{latent.name}: its codec knows its own directions only; decode it (nacre btf "
                    "decode) and render that with measuredbtf"
                )
            height, width, values = codes.shape
            resolution = int(_number(properties, "resolution", RESOLUTION, 2.0))
            tabulated = _choice(properties, "decoder", DECODERS) == "table"
            if not tabulated and codec.hit_form not in HIT_DECODERS:
                raise NacreError(
                    f"{latent.name}: a codec of kind {codec.kind} cannot run at every hit; take "
                    "decoder 'table'"
                )
            half = _choice(properties, "precision", ("single", "half")) == "half"
            coefficients = _choice(properties, "coefficients", COEFFICIENTS)

            levels = level_shapes(height, width)[: None if self.pixel_angle else 1]
            texels = sum(rows * columns for rows, columns in levels)

            def texel_bytes(numbers: int, half: bool) -> int:
                return texels * record_bytes(numbers, half)

            wide = codec.expanded_dim or values
            expanded = codec.expanded_dim is not None and coefficients != "hit"
            if coefficients == "auto" and texel_bytes(wide, half) > self.memory:
                expanded = False
            needed = texel_bytes(wide if expanded else values, half)
            if tabulated:
                needed = texel_bytes(GREYS + 2 * CHROMAS, half=True)
                needed += resolution**4 * record_bytes(GREYS + CHROMAS, half=True)
            _check_memory(latent.name, needed, self.memory)
            if tabulated:
                factors = factor(latent, resolution, len(levels), progress)
                self.decoder = TableDecoder(mi, factors, self.stochastic)
                return height, width, latent_lobes(latent)
            self.wavefront = True
            maps = [codes.astype(np.float32)]
            if self.pixel_angle:
                maps = list(LatentPyramid.build(latent, progress=progress).levels)
            flat = np.concatenate([one.reshape(-1, values) for one in maps])
            self.decoder = HIT_DECODERS[codec.hit_form](mi, codec, flat, expanded, half)
            return height, width, latent_lobes(latent)

    class MeasuredTexture(Texture):
        """The plugin `measuredbtf`."""

        def prepare(
            self, properties: Any, path: Path | None, source: Any, progress: Progress
        ) -> tuple[int, int, Floats]:
            from nacre.textures.formats import load

            if self.pixel_angle:
                raise NacreError(
                    "measuredbtf: pixel_angle filters encoded textures; encode it (nacre btf "
                    "encode), or leave the angle out"
                )
            btf: Btf = load(path) if path is not None else source
            sides = Sides.of(btf)
            self.decoder = MeasuredDecoder(mi, btf, sides, self.stochastic, self.memory)
            return btf.height, btf.width, table_lobes(btf, sides)

    return {"neuralbtf": NeuralTexture, "measuredbtf": MeasuredTexture}


def _path(mi: Any, properties: Any) -> Path:
    if "filename" not in properties:
        raise FormatError(f"{properties.plugin_name()}: give it the property 'filename'")
    return _resolved(mi, properties["filename"])


def _resolved(mi: Any, filename: Any) -> Path:
    return Path(str(mi.file_resolver().resolve(str(filename))))


def _choice(properties: Any, name: str, choices: tuple[str, ...]) -> str:
    value = str(properties.get(name, choices[0]))
    if value not in choices:
        raise NacreError(
            f"{properties.plugin_name()}: {name} is one of {', '.join(choices)}; got {value!r}"
        )
    return value


def _number(properties: Any, name: str, default: float, least: float) -> float:
    value = float(properties.get(name, default))
    if not (math.isfinite(value) and value >= least):
        raise NacreError(
            f"{properties.plugin_name()}: {name} is a number from {least:g} on; got {value:g}"
        )
    return value


def _check_memory(name: str, needed: int, limit: int) -> None:
    if needed > limit:
        raise NacreError(
            f"{name}: needs {needed / 2**20:,.0f} MiB, {limit / 2**20:,.0f} are allowed; lower the "
            "resolution, or raise memory"
        )
