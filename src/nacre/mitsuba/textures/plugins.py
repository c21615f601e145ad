"""Mitsuba BSDFs for textures: the plugins `neuralbtf` and `measuredbtf`."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Components, Floats
from nacre.btf import Btf
from nacre.errors import NacreError, require
from nacre.mitsuba.bsdf_base import base_class, choice, material_path, number, resolved
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.textures.decoders import HIT_DECODERS, HitDecoder, TableDecoder
from nacre.mitsuba.textures.measured import MeasuredDecoder, Sides, table_lobes
from nacre.mitsuba.textures.placement import Placement, footprint
from nacre.mitsuba.textures.relief import Relief
from nacre.mitsuba.textures.texels import INTERPOLATIONS, Records, TexelGrid, record_bytes
from nacre.runtime.progress import Progress, silent
from nacre.sampling.tilted import TiltedMixture
from nacre.textures.factors import CHROMAS, LUMAS, factor
from nacre.textures.height_file import read_heights
from nacre.textures.latent_file import load_latent_map
from nacre.textures.latent_map import LatentMap
from nacre.textures.lobes import latent_lobes
from nacre.textures.mipmap import LatentPyramid, level_shapes

DECODERS = "table", "network"
COEFFICIENTS = "auto", "texture", "hit"
RESOLUTION = 20
"""Nodes along each axis of the grid of directions."""
MEMORY = 2048
"""MiB that the data of a texture may take."""


def texture_bsdf(texture: LatentMap | Btf, progress: Progress = silent, **options: Any) -> Any:
    """A Mitsuba BSDF for a texture in memory, to put into scene dictionaries.

    If no variant is set, this sets the one that :func:`nacre.mitsuba.mitsuba` starts with.

    Parameters
    ----------
    texture
        Rendered by `neuralbtf` if it is encoded, else by `measuredbtf`.
    progress
        Called while functions are tabulated.
    options
        Properties of the plugin:

        - `interpolation`: see :class:`nacre.mitsuba.textures.texels.TexelGrid`; it applies to
          directions too, where "nearest" means "linear".
        - `pixel_angle`: degrees between neighboring pixels of the camera. If given, hits on an
          encoded texture show the mean reflectance that a pixel sees, from afar and at grazing
          angles. It comes from a pyramid of levels that takes a third more memory. (Paths in
          Mitsuba carry no ray differentials that would tell the angle.)
        - `to_uv`: as in Mitsuba's `bitmap`.
        - `height_field`: a gray image for parallax, and `depth`: from black to white, in texture
          widths.
        - `memory`: MiB that the data may take, by default :data:`MEMORY`.

        and for `neuralbtf`:

        - `decoder`: "table", the texture's own functions on a grid of directions
          (:mod:`nacre.textures.factors`), or "network", the codec's networks at every hit.
        - `resolution`: of that grid, by default :data:`RESOLUTION`.
        - `coefficients`: for the default codec's networks, kept in memory for each "texture", or
          computed at each "hit"; "auto" is "texture" if there is enough memory.
        - `precision`: of the networks, "single" or "half".

    Raises
    ------
    NacreError
        If an option is unknown or out of range, the variant does not compile, the texture needs
        more memory than is allowed, or its codec works for its own directions only.
    """
    mi = mitsuba()
    source = getattr(texture, "latent", None) or texture
    name = "neuralbtf" if isinstance(source, LatentMap) else "measuredbtf"
    properties = mi.Properties(name)
    for key, value in options.items():
        properties[key] = value
    return plugins(mi.variant())[name](properties, source, progress)


@cache
def plugins(variant: str) -> dict[str, Any]:
    """The plugin classes for the variant that is set, by name."""
    mi: Any = require("mitsuba", "render")

    class Texture(base_class(variant)):  # type: ignore[misc]
        """What both plugins share; subclasses make the decoder and the lobes."""

        decoder: HitDecoder

        def prepare(self, properties: Any, source: Any = None, progress: Progress = silent) -> Any:
            name = properties.plugin_name()
            if mi.Float is float:
                raise NacreError(f"{name}: needs a variant that compiles, got {variant}")
            self.interpolation = choice(properties, "interpolation", INTERPOLATIONS)
            self.memory = int(number(properties, "memory", MEMORY, 1.0)) << 20
            self.pixel_angle = math.radians(number(properties, "pixel_angle", 0.0, 0.0))
            self.placement = Placement(mi, properties.get("to_uv"))
            height_field, depth = properties.get("height_field"), properties.get("depth")
            if (height_field is None) != (depth is None):
                raise NacreError(f"{name}: height_field and depth belong together; give both")
            self.stochastic = self.interpolation == "stochastic"
            path = material_path(properties) if source is None else None
            self.height, self.width, lobes = self.prepare_decoder(
                properties, path, source, progress
            )
            levels = level_shapes(self.height, self.width) if self.pixel_angle else None
            self.grid = TexelGrid(mi, self.height, self.width, self.interpolation, levels)
            self.lobe_grid = TexelGrid(mi, len(lobes), lobes.shape[1], self.interpolation)
            self.lobes = Records(mi, lobes.reshape(-1, lobes.shape[2]), half=True)
            self.relief: Relief | None = None
            if height_field is not None:
                heights = read_heights(resolved(height_field))
                depth = number(properties, "depth", 0.0, 0.0)
                self.relief = Relief(mi, heights, depth, self.width / self.height)
            return mi.BSDFFlags.SpatiallyVarying | mi.BSDFFlags.Anisotropic

        def prepare_decoder(
            self, properties: Any, path: Path | None, source: Any, progress: Progress
        ) -> tuple[int, int, Floats]:
            """Make the decoder; returns height and width of the map, and its lobes."""
            raise NotImplementedError

        def to_local(self, si: Any, w: Any) -> Components:
            return self.placement.to_texture(si, tuple(w))

        def from_local(self, si: Any, w: Components) -> Components:
            return self.placement.from_texture(si, w)

        def at(self, si: Any, view: Components) -> tuple[Any, TiltedMixture]:
            uv = self.placement.uv(si)
            if self.relief is not None:
                uv = self.relief.seen(uv, view)
            fraction, roughness, x, y = self.lobes.at(self.lobe_grid.around(uv))
            mixture = TiltedMixture(fraction, roughness, (x, y))
            if not self.pixel_angle:
                return self.decoder.texels(self.grid.around(uv)), mixture
            seen = footprint(mi, si, self.placement, self.pixel_angle, self.height, self.width)
            return self.decoder.texels(self.grid.seen(uv, seen)), mixture

        def f_r(self, state: Any, wi: Components, wo: Components) -> Components:
            red, green, blue = self.decoder.reflectance(state, wi, wo)
            return red * (1.0 / math.pi), green * (1.0 / math.pi), blue * (1.0 / math.pi)

        def describe(self) -> dict[str, Any]:
            shown = {name: getattr(self, name) for name in ("width", "height", "interpolation")}
            return shown | {"decoder": type(self.decoder).__name__}

    class NeuralTexture(Texture):
        """The plugin `neuralbtf`."""

        def prepare_decoder(
            self, properties: Any, path: Path | None, source: Any, progress: Progress
        ) -> tuple[int, int, Floats]:
            latent: LatentMap = load_latent_map(path) if path is not None else source
            codec = latent.codec
            if not codec.any_directions:
                raise NacreError(
                    f"{latent.name}: its codec knows its own directions only; decode it (nacre btf "
                    "decode) and render that with measuredbtf"
                )
            height, width, values = latent.shape
            resolution = int(number(properties, "resolution", RESOLUTION, 2.0))
            tabulated = choice(properties, "decoder", DECODERS) == "table"
            if not tabulated and codec.hit_form not in HIT_DECODERS:
                raise NacreError(
                    f"{latent.name}: a codec of kind {codec.kind} cannot run at every hit; take "
                    "decoder 'table'"
                )
            half = choice(properties, "precision", ("single", "half")) == "half"
            coefficients = choice(properties, "coefficients", COEFFICIENTS)

            levels = level_shapes(height, width)[: None if self.pixel_angle else 1]
            texels = sum(rows * columns for rows, columns in levels)
            wide = codec.expanded_dim or values
            expanded = codec.expanded_dim is not None and coefficients != "hit"
            if coefficients == "auto" and texels * record_bytes(wide, half) > self.memory:
                expanded = False
            needed = texels * record_bytes(wide if expanded else values, half)
            if tabulated:
                needed = texels * record_bytes(LUMAS + 2 * CHROMAS, half=True)
                needed += resolution**4 * record_bytes(LUMAS + CHROMAS, half=True)
            if needed > self.memory:
                raise NacreError(
                    f"{latent.name}: needs {needed / 2**20:,.0f} MiB, {self.memory / 2**20:,.0f} "
                    "are allowed; lower the resolution, or raise memory"
                )
            if tabulated:
                factors = factor(latent, resolution, len(levels), progress)
                self.decoder = TableDecoder(mi, factors, self.stochastic)
                return height, width, latent_lobes(latent)
            self.wavefront = True
            flat = latent.codes.astype(np.float32, copy=False).reshape(-1, values)
            if self.pixel_angle:
                maps = LatentPyramid.build(latent, progress=progress).levels
                flat = np.concatenate([one.reshape(-1, values) for one in maps])
            self.decoder = HIT_DECODERS[codec.hit_form](mi, codec, flat, expanded, half)
            return height, width, latent_lobes(latent)

    class MeasuredTexture(Texture):
        """The plugin `measuredbtf`."""

        def prepare_decoder(
            self, properties: Any, path: Path | None, source: Any, progress: Progress
        ) -> tuple[int, int, Floats]:
            from nacre.formats import load_btf

            if self.pixel_angle:
                raise NacreError(
                    "measuredbtf: pixel_angle filters encoded textures; encode this one (nacre "
                    "fit), or leave the angle out"
                )
            btf: Btf = load_btf(path) if path is not None else source
            sides = Sides.of(btf)
            self.decoder = MeasuredDecoder(mi, btf, sides, self.stochastic, self.memory)
            return btf.height, btf.width, table_lobes(btf, sides)

    return {"neuralbtf": NeuralTexture, "measuredbtf": MeasuredTexture}
