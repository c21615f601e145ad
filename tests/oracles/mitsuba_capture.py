"""Virtual capture by Mitsuba's path integrator, on the triangles that nacre's tracer sees."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.mitsuba.mesh import triangle_mesh
from nacre.textures.capture import Mesostructure
from nacre.textures.capture.gonioreflectometer import DEPTH

_PERIODS = 5
CELLS = 64


def bumps(
    amplitude: float,
    albedo: Any = 0.5,
    specular: Any = 0.0,
    roughness: tuple[float, float] = (0.3, 0.3),
) -> Mesostructure:
    """An egg carton with slanting ridges, twice a period, of one color or of one a cell."""
    y, x = np.mgrid[:CELLS, :CELLS] * (4.0 * np.pi / CELLS)
    height = amplitude * (np.sin(x) * np.sin(y) + 0.4 * np.sin(2.0 * x + y))
    shape = (CELLS, CELLS)
    return Mesostructure(
        height,
        np.broadcast_to(albedo, (*shape, 3)).astype(float),
        np.broadcast_to(specular, (*shape, 3)).astype(float),
        np.broadcast_to(roughness, (*shape, 2)).astype(float),
        np.zeros(shape),
    )


def diffuse_under_ggx(mi: Any) -> type[Any]:
    """A BSDF plugin of the formula in :mod:`nacre.textures.capture.reflection`, from its parts.

    Directions are sampled by the cosine.
    """
    import drjit as dr

    class DiffuseUnderGgx(mi.BSDF):
        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            self.albedo, self.specular = props["albedo"], props["specular"]
            self.microfacets = mi.MicrofacetDistribution(
                mi.MicrofacetType.GGX, props["along"], props["across"]
            )
            self.m_flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
            self.m_components = [self.m_flags]

        def fresnel(self, cosine: Any) -> Any:
            edge = min(1.0, 50.0 * self.specular)
            return self.specular + (edge - self.specular) * (1.0 - cosine) ** 5

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any) -> Any:
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.warp.square_to_cosine_hemisphere(sample2)
            bs.pdf = mi.warp.square_to_cosine_hemisphere_pdf(bs.wo)
            bs.eta = 1.0
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
            bs.sampled_component = mi.UInt32(0)
            value = self.eval(ctx, si, bs.wo, active) / bs.pdf
            return bs, value & (bs.pdf > 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
            cos_view, cos_light = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            half = dr.normalize(si.wi + wo)
            lobe = self.microfacets.eval(half) * self.microfacets.G(si.wi, wo, half)
            lobe *= self.fresnel(dr.dot(half, wo)) / (4.0 * cos_view * cos_light)
            through = (1.0 - self.fresnel(cos_view)) * (1.0 - self.fresnel(cos_light))
            value = (self.albedo * through / dr.pi + lobe) * cos_light
            return mi.Spectrum(value) & ((cos_view > 0.0) & (cos_light > 0.0))

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
            return mi.warp.square_to_cosine_hemisphere_pdf(wo)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def traverse(self, callback: Any) -> None:
            pass

    return DiffuseUnderGgx


def mesh(mi: Any, surface: Mesostructure, bsdf: dict[str, Any]) -> Any:
    """The surface over several periods, the middle one of which covers the unit square."""
    size, count = surface.size, surface.size * _PERIODS
    y, x = np.mgrid[: count + 1, : count + 1]
    z = surface.height[y % size, x % size]
    vertices = np.stack([x / size - _PERIODS // 2, y / size - _PERIODS // 2, z], -1).reshape(-1, 3)
    corner = (y * (count + 1) + x)[:-1, :-1]
    east, north, far = corner + 1, corner + count + 1, corner + count + 2
    faces = np.stack([corner, east, far, corner, far, north], -1).reshape(-1, 3)
    albedo = surface.albedo[y[:-1, :-1] % size, x[:-1, :-1] % size].repeat(2, 1)
    result = triangle_mesh(mi, "surface", vertices, faces, bsdf, vertices[:, :2])
    result.add_attribute("face_albedo", 3, albedo.reshape(-1).astype(np.float32))
    return result


def path_integrator(mi: Any) -> Any:
    """Paths of as many surface points as the tracer's, none ended at random."""
    return mi.load_dict({"type": "path", "max_depth": DEPTH + 1, "rr_depth": 100})


def lit(mi: Any, shape: Any, light: np.ndarray) -> Any:
    """A scene of one shape under one distant light."""
    lamp = {"type": "directional", "direction": (-light).tolist(), "irradiance": 1.0}
    return mi.load_dict({"type": "scene", "shape": shape, "lamp": lamp})


def camera_rays(
    mi: Any,
    surface: Mesostructure,
    view: np.ndarray,
    texels: int,
    samples: int,
    random: np.random.Generator,
) -> Any:
    """Rays of an orthographic camera, texel after texel, through points of the plane z = 0."""
    row, column, _ = np.indices((texels, texels, samples))
    at = np.stack([column, texels - 1 - row]) + random.uniform(size=(2, *row.shape))
    start = np.stack([*at / texels, np.zeros(row.shape)]).reshape(3, -1)
    start = start + view[:, None] * (1.01 * surface.height.max() / view[2])
    return mi.RayDifferential3f(mi.Point3f(start), mi.Vector3f(*(-view).tolist()))


def reference(
    mi: Any,
    surface: Mesostructure,
    bsdf: dict[str, Any],
    lights: np.ndarray,
    views: np.ndarray,
    texels: int,
    samples: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Reflectance factors, (texels, texels, views x lights, 3), and the variance of each."""
    integrator = path_integrator(mi)
    random = np.random.default_rng(5)
    shape = mesh(mi, surface, bsdf)
    means, variances = [], []
    for view in views:
        for light in lights:
            ray = camera_rays(mi, surface, view, texels, samples, random)
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(len(means), texels**2 * samples)
            radiance, _, _ = integrator.sample(lit(mi, shape, light), sampler, ray)
            values = np.array(radiance).T.reshape(texels, texels, samples, 3)
            values = np.pi * values / light[2]
            means.append(values.mean(2))
            variances.append(values.var(2, ddof=1) / samples)
    return np.stack(means, 2), np.stack(variances, 2)
