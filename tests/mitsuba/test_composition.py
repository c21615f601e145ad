"""nacre's BSDFs within Mitsuba's, in instances and media, under every integrator."""

from __future__ import annotations

import gc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from tests.tiers import tiered

from .reflectances import Constant, network

WHITE = 0.5


def _flat(mi: Any, *color: float) -> dict[str, Any]:
    pixels = mi.Bitmap(np.full((2, 2, len(color)), color, np.float32))
    return {"type": "bitmap", "raw": True, "bitmap": pixels}


WITHIN: dict[str, Callable[[Any, Any], Any]] = {
    "twosided": lambda _, bsdf: {"type": "twosided", "of": bsdf},
    "mask": lambda _, bsdf: {"type": "mask", "opacity": 1.0, "of": bsdf},
    "blendbsdf": lambda _, bsdf: {"type": "blendbsdf", "weight": 0.3, "a": bsdf, "b": bsdf},
    "normalmap": lambda mi, bsdf: {
        "type": "normalmap", "normalmap": _flat(mi, 0.5, 0.5, 1.0), "of": bsdf
    },
    "bumpmap": lambda mi, bsdf: {"type": "bumpmap", "arbitrary": _flat(mi, 0.5), "of": bsdf},
    "three": lambda mi, bsdf: {
        "type": "mask",
        "opacity": 1.0,
        "of": {
            "type": "twosided",
            "of": {"type": "blendbsdf", "weight": 0.5, "a": bsdf, "b": bsdf},
        },
    },
}  # fmt: skip
"""BSDFs that look like the one within them."""

INTEGRATORS = (
    *("path", "direct", "volpath", "volpathmis", "ptracer"),
    *("prb", "prb_basic", "prb_projective", "direct_projective", "prbvolpath"),
)


def scene(
    mi: Any,
    bsdf: Any,
    integrator: str | dict[str, Any] = "path",
    instanced: bool = False,
    medium: str = "",
) -> Any:
    """A ball under a lamp and a sky; in the `medium` "inside", "outside" or "both"."""
    place = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 16, "height": 12, "rfilter": {"type": "box"}}
    ball: dict[str, Any] = {"type": "sphere", "bsdf": bsdf}
    lamp = {"type": "area", "radiance": {"type": "rgb", "value": 10.0}}
    sensor = {"type": "perspective", "to_world": place, "film": film}
    made: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": integrator} if isinstance(integrator, str) else integrator,
        "sky": {"type": "constant"},
    }
    if medium in ("inside", "both"):
        ball["interior"] = {"type": "homogeneous", "sigma_t": 1.0}
    if medium in ("outside", "both"):
        made["fog"] = {"type": "homogeneous", "sigma_t": 0.1}
        ball["exterior"] = sensor["medium"] = {"type": "ref", "id": "fog"}
    made["sensor"] = sensor
    made["lamp"] = {"type": "sphere", "center": [2, 3, 4], "radius": 0.5, "emitter": lamp}
    if instanced:
        made["group"] = {"type": "shapegroup", "ball": ball}
        made["ball"] = {"type": "instance", "of": {"type": "ref", "id": "group"}}
    else:
        made["ball"] = ball
    return mi.load_dict(made)


def rendered(mi: Any, spp: int = 64, **described: Any) -> npt.NDArray[np.float64]:
    picture = np.array(mi.render(scene(mi, **described), spp=spp, seed=1), np.float64)
    assert np.isfinite(picture).all()
    return picture


@pytest.fixture(params=tiered(["literals", "cooperative"], {"cooperative"}))
def bsdf(rgb: Any, request: pytest.FixtureRequest) -> Any:
    return nacre.mitsuba.bsdf(network(1), weights=request.param)


@pytest.mark.parametrize("name", tiered(WITHIN, {"twosided", "three"}))
def test_a_network_within_another_bsdf_looks_as_alone(rgb: Any, bsdf: Any, name: str) -> None:
    alone, within = (rendered(rgb, bsdf=each) for each in (bsdf, WITHIN[name](rgb, bsdf)))
    if name in ("blendbsdf", "bumpmap", "three"):  # which draw more numbers
        assert abs(within.mean() / alone.mean() - 1.0) < 0.02
    else:
        np.testing.assert_allclose(within, alone, rtol=1e-3, atol=1e-4)
    aov = {"type": "aov", "aovs": "a:albedo"}
    albedos = [
        rendered(rgb, 4, bsdf=each, integrator=aov)[..., -3:]
        for each in (bsdf, WITHIN[name](rgb, bsdf))
    ]
    assert albedos[0].max() > 0.5
    np.testing.assert_allclose(albedos[1], albedos[0], rtol=1e-3, atol=1e-4)


def test_a_blend_is_the_mean_and_half_a_mask_half_the_picture(rgb: Any, bsdf: Any) -> None:
    if rgb.__version__.startswith("3.7."):
        pytest.skip("Mitsuba 3.7 blends its own BSDFs wrongly, too")
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": WHITE}}
    direct = {"type": "direct", "emitter_samples": 4, "bsdf_samples": 4, "hide_emitters": True}
    pictures = [
        rendered(rgb, bsdf=each, integrator=direct)
        for each in (
            bsdf,
            diffuse,
            {"type": "blendbsdf", "weight": 0.3, "a": bsdf, "b": diffuse},
            {"type": "mask", "opacity": 0.25, "of": bsdf},
        )
    ]
    network_alone, diffuse_alone, blend, mask = (picture.mean() for picture in pictures)
    assert blend == pytest.approx(0.7 * network_alone + 0.3 * diffuse_alone, rel=0.01)
    assert mask == pytest.approx(0.25 * network_alone, rel=0.02)


def test_an_instance_looks_like_the_shape(rgb: Any, bsdf: Any) -> None:
    shape, instance = (rendered(rgb, bsdf=bsdf, instanced=each) for each in (False, True))
    np.testing.assert_allclose(instance, shape, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("integrator", tiered(INTEGRATORS, {"prb", "ptracer"}))
def test_a_lambertian_reflectance_is_mitsubas_diffuse(rgb: Any, integrator: str) -> None:
    ours = rendered(rgb, bsdf=nacre.mitsuba.bsdf(Constant(WHITE)), integrator=integrator)
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": WHITE}}
    theirs = rendered(rgb, bsdf=diffuse, integrator=integrator)
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)
    assert np.abs(ours - theirs).mean() < 0.05 * theirs.mean()


@pytest.mark.parametrize(
    ("integrator", "medium"),
    tiered(
        [
            (integrator, medium)
            for integrator in ("volpath", "volpathmis", "prbvolpath")
            for medium in ("inside", "outside", "both")
        ],
        {("volpath", "both")},
    ),
)
def test_a_lambertian_ball_in_media_is_mitsubas(rgb: Any, integrator: str, medium: str) -> None:
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": WHITE}}
    ours, theirs = (
        rendered(rgb, 256, bsdf=each, integrator=integrator, medium=medium)
        for each in (nacre.mitsuba.bsdf(Constant(WHITE)), diffuse)
    )
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.03)


@pytest.mark.parametrize("integrator", tiered(INTEGRATORS[5:], {"prb"}))
def test_adjoint_integrators_show_a_network_as_path_tracing_does(
    rgb: Any, bsdf: Any, integrator: str
) -> None:
    shown = rendered(rgb, 256, bsdf=bsdf, integrator=integrator)
    kind = "direct" if integrator.startswith("direct") else "path"
    expected = rendered(rgb, 256, bsdf=bsdf, integrator=kind)
    assert shown.mean() == pytest.approx(expected.mean(), rel=0.02)


def _resident() -> float:
    """Resident memory of this process in MB."""
    import resource

    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs Linux's /proc")
@pytest.mark.parametrize("kind", ["weights", "code"])
def test_memory_stays_flat_while_pictures_are_matched(rgb: Any, kind: str) -> None:
    import drjit as dr

    random = np.random.default_rng(0)
    given = {
        "weights": nacre.mitsuba.bsdf(network(2), weights="cooperative"),
        "code": {"type": "nbrdf", "code": ",".join(map(str, random.normal(0, 0.3, 32)))},
    }
    target = rgb.render(scene(rgb, nacre.mitsuba.bsdf(network(1)), "prb"), spp=512)
    shown = scene(rgb, given[kind], "prb")
    parameters = rgb.traverse(shown)
    key = next(name for name in parameters.keys() if name.endswith(kind))  # noqa: SIM118
    optimizer = rgb.ad.Adam(lr=5e-3, params={key: parameters[key]})

    def error(spp: int, seed: int) -> Any:
        picture = rgb.render(shown, parameters, spp=spp, seed=seed)
        return dr.mean(dr.square(picture - target), axis=None)

    before, memory = float(error(512, 0).array[0]), []
    for step in range(80):
        parameters.update(optimizer)
        dr.backward(error(4, step))
        optimizer.step()
        if step % 10 == 9:
            gc.collect()
            memory.append(_resident())
    parameters.update(optimizer)
    assert float(error(512, 0).array[0]) < 0.7 * before
    assert memory[-1] - memory[2] < 3.0
