"""Small scenes of every integrator, film, sensor, sampler, medium and emitter that Mitsuba has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

LOOK = '<transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>'
BOX = '<rfilter type="box"/>'
SIZE = '<integer name="width" value="16"/><integer name="height" value="12"/>'
PIXEL = '<integer name="width" value="1"/><integer name="height" value="1"/>'
PATH = '<integrator type="path"/>'
LIGHTS = (
    '<emitter type="constant"/>'
    '<emitter type="point"><point name="position" x="2" y="3" z="4"/></emitter>'
)
WALL = (
    '<shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-1"/>'
    '</transform><bsdf type="diffuse"><rgb name="reflectance" value=".6,.3,.1"/></bsdf></shape>'
)
BALL = f'<shape type="sphere"><bsdf type="roughplastic"/></shape>{WALL}'
FOG = '<medium type="homogeneous" id="fog"><float name="sigma_t" value=".1"/></medium>'
BANDS = '<spectrum name="z_red" value="500:0,700:1"/><spectrum name="blue" value="400:1,500:.5"/>'


def scene(
    integrator: str = PATH,
    sensor: str = "perspective",
    film: str = "hdrfilm",
    filming: str = "",
    size: str = SIZE,
    sampler: str = "independent",
    samples: int = 4,
    within: str = LOOK,
    lights: str = LIGHTS,
    body: str = BALL,
) -> str:
    """A scene in XML; `filming` stands in the film, `within` in the sensor."""
    return (
        f'<scene version="3.0.0">{integrator}<sensor type="{sensor}">'
        f'<film type="{film}">{size}{BOX}{filming}</film><sampler type="{sampler}">'
        f'<integer name="sample_count" value="{samples}"/></sampler>{within}</sensor>'
        f"{lights}{body}</scene>"
    )


def pixels(kind: str, component: str) -> str:
    """What makes a film hold pixels of a kind."""
    return (
        f'<string name="pixel_format" value="{kind}"/>'
        f'<string name="component_format" value="{component}"/>'
    )


def integrator(kind: str, within: str = "") -> str:
    return f'<integrator type="{kind}">{within}</integrator>'


def aov(aovs: str, within: str = PATH) -> str:
    return integrator("aov", f'<string name="aovs" value="{aovs}"/>{within}')


def write_files(folder: Path, mi: Any) -> None:
    """The texture, the map and the volume that scenes name."""
    random = np.random.default_rng(0)
    mi.Bitmap(random.integers(0, 256, (4, 4, 3), np.uint8)).write(str(folder / "texture.png"))
    mi.Bitmap(random.random((4, 8, 3), np.float32)).write(str(folder / "sky.exr"))
    mi.VolumeGrid(random.random((4, 4, 4), np.float32)).write(str(folder / "smoke.vol"))
    fibers = np.float32([0.3, 0.2, 1.0, 0.0, 0.0, 0.1]) * np.ones((2, 2, 2, 1), np.float32)
    mi.VolumeGrid(fibers).write(str(folder / "fibers.vol"))


def _textured(light: str = "", lamp: str = "") -> str:
    texture = (
        '<texture type="bitmap" name="reflectance"><string name="filename" value="texture.png"/>'
        "</texture>"
    )
    ball = f'<shape type="sphere"><bsdf type="diffuse">{texture}</bsdf></shape>'
    turned = '<lookat origin="2,2,3" target="0,0,0" up="0,1,0"/>'
    shape = f'<shape type="rectangle"><transform name="to_world">{turned}</transform>{lamp}</shape>'
    return scene(lights=light, body=ball + (shape if lamp else ""))


def _filled(medium: str, tracer: str = "volpath", bsdf: str = "null") -> str:
    ball = f'<shape type="sphere"><bsdf type="{bsdf}"/>{medium}</shape>'
    return scene(integrator(tracer), body=ball + WALL)


def _homogeneous(phase: str, within: str = "") -> str:
    return _filled(
        '<medium type="homogeneous" name="interior"><rgb name="albedo" value=".9,.5,.2"/>'
        f'<float name="sigma_t" value="1"/><phase type="{phase}">{within}</phase></medium>'
    )


_SMOKE = (
    '<medium type="heterogeneous" name="interior"><volume type="gridvolume" name="sigma_t">'
    '<string name="filename" value="smoke.vol"/></volume><float name="scale" value="2"/></medium>'
)

INTEGRATORS = {
    **{
        kind: scene(integrator(kind))
        for kind in ("path", "volpath", "volpathmis", "direct", "ptracer", "depth")
    },
    "aov": scene(aov("d:depth,p:position,n:sh_normal,g:geo_normal,a:albedo,t:uv,i:prim_index")),
    "aov of two": scene(
        aov("d:depth", '<integrator type="path" name="a"/><integrator type="direct" name="b"/>')
    ),
    "aov alone": scene(aov("d:depth,n:sh_normal", "")),
    "moment": scene(integrator("moment", PATH)),
    "moment of aov": scene(integrator("moment", aov("d:depth"))),
}
ADJOINT_INTEGRATORS = {
    kind: scene(integrator(kind))
    for kind in ("prb", "prb_basic", "prb_projective", "direct_projective", "prbvolpath")
}
FILMS = {
    **{
        f"{kind} {component}": scene(filming=pixels(kind, component))
        for kind in ("luminance", "luminance_alpha", "rgb", "rgba", "xyz", "xyza")
        for component in ("float16", "float32", "uint32")
    },
    **{
        f"aov in {kind} {component}": scene(
            aov("d:depth,n:sh_normal"), filming=pixels(kind, component)
        )
        for kind in ("luminance_alpha", "rgba", "xyz")
        for component in ("float16", "float32", "uint32")
    },
    "cropped": scene(
        filming="".join(
            f'<integer name="crop_{name}" value="{value}"/>'
            for name, value in (("width", 7), ("height", 5), ("offset_x", 3), ("offset_y", 2))
        )
    ),
    "rgbe": scene(filming='<string name="file_format" value="rgbe"/>'),
    "with borders": scene(filming='<boolean name="sample_border" value="true"/>'),
}
SPECTRAL_FILM = scene(film="specfilm", filming=BANDS)
SENSORS = {
    "orthographic": scene(sensor="orthographic"),
    "thinlens": scene(
        sensor="thinlens",
        within=f'{LOOK}<float name="aperture_radius" value=".1"/>'
        '<float name="focus_distance" value="3"/>',
    ),
    "radiancemeter": scene(sensor="radiancemeter", size=PIXEL),
    "distant": scene(
        sensor="distant",
        size=PIXEL,
        within='<vector name="direction" x="0" y=".2" z="-1"/>',
    ),
    "irradiancemeter": scene(body=WALL, within="", size=PIXEL)
    .replace(
        '<sensor type="perspective">', '<shape type="rectangle"><sensor type="irradiancemeter">'
    )
    .replace("</sensor>", "</sensor></shape>"),
    "batch": scene(
        sensor="batch",
        within=f'<sensor type="perspective">{LOOK}</sensor>'
        f'<sensor type="orthographic">{LOOK}</sensor>',
    ),
}
SAMPLERS = {
    kind: scene(sampler=kind, samples=9)
    for kind in ("independent", "stratified", "multijitter", "orthogonal", "ldsampler")
}
MEDIA = {
    **{kind: _homogeneous(kind) for kind in ("isotropic", "hg", "rayleigh")},
    "tabphase": _homogeneous("tabphase", '<string name="values" value="0.5,1,1.5"/>'),
    "blendphase": _homogeneous(
        "blendphase",
        '<float name="weight" value=".3"/><phase type="isotropic"/><phase type="hg"/>',
    ),
    "sggx": _homogeneous(
        "sggx",
        '<volume type="gridvolume" name="S"><boolean name="raw" value="true"/>'
        '<string name="filename" value="fibers.vol"/></volume>',
    ),
    "heterogeneous": _filled(_SMOKE),
    "heterogeneous in glass": _filled(_SMOKE, "volpathmis", "roughdielectric"),
    "around the camera": scene(FOG + integrator("volpath"), within=f'{LOOK}<ref id="fog"/>'),
}
EMITTERS = {
    "area": _textured(lamp='<emitter type="area"/>'),
    "directionalarea": _textured(lamp='<emitter type="directionalarea"/>').replace(
        PATH, integrator("ptracer")
    ),
    "constant": _textured('<emitter type="constant"/>'),
    "directional": _textured(
        '<emitter type="directional"><vector name="direction" x="0" y="-1" z="-1"/></emitter>'
    ),
    "envmap": _textured(
        '<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>'
    ),
    "point": _textured(
        '<emitter type="point"><point name="position" x="0" y="0" z="4"/></emitter>'
    ),
    "projector": _textured(
        '<emitter type="projector"><texture type="bitmap" name="irradiance">'
        f'<string name="filename" value="texture.png"/></texture>{LOOK}</emitter>'
    ),
    "spot": _textured(f'<emitter type="spot">{LOOK}</emitter>'),
    "sunsky": _textured('<emitter type="sunsky"/>'),
}
