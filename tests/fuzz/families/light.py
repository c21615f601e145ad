"""Scenes of Mitsuba, and light from all around."""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random

import numpy as np

from nacre.io.image_file import PIXEL_LIMIT
from nacre.mitsuba.environment import load_environment, sphere_mean
from nacre.mitsuba.scene_file import load_scene, scene_bsdfs
from nacre.mitsuba.scene_guard import check_scene
from tests.fuzz.damage import words_damage
from tests.fuzz.readers import Reader, reader
from tests.specimens import SPECIMENS
from tests.specimens.images import png_bytes
from tests.specimens.specimen import NUMBERS, Array, mutated

_SCENES = (
    b"""<scene version="3.0.0">
<default name="spp" value="4"/>
<integrator type="path"><integer name="max_depth" value="5"/></integrator>
<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
<sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
<film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="3"/>
<rfilter type="box"/></film></sensor>
<bsdf type="roughconductor" id="metal"><string name="material" value="Al"/>
<float name="alpha" value="0.2"/></bsdf>
<shape type="sphere"><point name="center" x="0" y="0.5" z="0"/><ref id="metal"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="2"/><rotate x="1" angle="-90"/>
</transform><bsdf type="diffuse"><rgb name="reflectance" value="0.2, 0.25, 0.7"/></bsdf></shape>
<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
</scene>
""",
    b'<scene version="3.0.0"><shape type="cube"><bsdf type="nbrdf" id="paint">'
    b'<string name="filename" value="paint.safetensors"/></bsdf></shape></scene>',
    b'<bsdf version="3.0.0" type="twosided"><bsdf type="principled">'
    b'<float name="roughness" value="0.3"/></bsdf></bsdf>',
)
_WORDS = (
    *("float", "integer", "boolean", "string", "vector", "point", "rgb", "spectrum", "texture"),
    *("transform", "matrix", "include", "alias", "path", "ref", "default", "filename", "scene.xml"),
    *("obj", "ply", "bitmap", "instance", "shapegroup", "heterogeneous", "envmap", "area", "brdf"),
    *("measured", "blendbsdf", "bumpmap", "mask", "neuralbtf", "measuredbtf", "$spp", "$x", "true"),
    *("0 0 0 0", "1e999", "<shape>", "</shape>", "<!--", "&#0;", "&x;", "<![CDATA[", "/>", '"'),
)


def _read_scene(path: Path) -> None:
    load_scene(path)


def _read_bsdfs(path: Path) -> None:
    for bsdf in scene_bsdfs(path):
        bsdf.id()


def _scenes() -> list[bytes]:
    return [*_SCENES]


_companions = {"paint.safetensors": SPECIMENS["nacre neural material"].files()[0]}


def _whole_scenes() -> list[bytes]:
    return [*_SCENES[:2]]


_scene: Callable[..., Reader] = partial(
    reader, file="scene.xml", companions=_companions, memory=256 << 20
)


def _pixels(dtype: str = "<f4") -> Array:
    return np.linspace(0.0, 2.0, 4 * 8 * 3).reshape(4, 8, 3).astype(dtype)


def _by_mitsuba(pixels: Array, kind: str) -> bytes:
    import mitsuba as mi

    stream = mi.MemoryStream()
    mi.Bitmap(np.ascontiguousarray(pixels)).write(stream, getattr(mi.Bitmap.FileFormat, kind))
    return bytes(stream.raw_buffer())


def exr_files() -> list[bytes]:
    return [_by_mitsuba(_pixels(), "OpenEXR"), _by_mitsuba(_pixels("<f2"), "OpenEXR")]


def _hdr_files() -> list[bytes]:
    return [_by_mitsuba(_pixels(), "RGBE"), _hdr(b"-Y 4 +X 8", _packed_rows())]


def _hdr(size: bytes, rows: bytes) -> bytes:
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1.0\n\n" + size + b"\n" + rows


def _packed_rows() -> bytes:
    """Rows of 8 pixels, each channel a run."""
    return (b"\x02\x02" + struct.pack(">H", 8) + b"\x88\x80" * 4) * 4


def png_files() -> list[bytes]:
    values = np.arange(4 * 8 * 3, dtype="u1").reshape(4, 8, 3)
    return [png_bytes(values, 8, 4), png_bytes(values.astype("u2"), 8, 4)]


def _hdr_damage(data: bytes, random: Random) -> bytes:
    """The size and rows of a picture, neither of which need fit the other."""
    signs = [random.choice((b"-", b"+")) + random.choice((b"X", b"Y")) for _ in range(2)]
    edges = [str(random.choice((4, 8, 8, 40_000, *NUMBERS))).encode() for _ in range(2)]
    size = b"%s %s %s %s" % (signs[0], edges[0], signs[1], edges[1])
    rows = mutated(_packed_rows(), random)
    return _hdr(size if random.random() < 0.5 else b"-Y 4 +X 8", rows)


def image_damage(files: Callable[[], list[bytes]], ending: str) -> Callable[[bytes, Random], bytes]:
    """Small pictures with numbers overwritten near the start, or whole ones with odd headers."""

    def rebuild(data: bytes, random: Random) -> bytes:
        if random.random() < 0.2:
            return SPECIMENS[f"UTIA image ({ending})"].rebuild(data, random)
        return mutated(random.choice(files()), random)

    return rebuild


def _read_light(path: Path) -> None:
    light = load_environment(path)
    assert np.isfinite(light.pixels).all()
    assert np.isfinite(sphere_mean(light.pixels)).all(), "the light of a sphere is not finite"
    light.radiance([0.0, 0.6, 0.8])


# What packs well may have so many pixels in a small file.
_light: Callable[..., Reader] = partial(reader, read=_read_light, memory=16 * PIXEL_LIMIT)

READERS = (
    _scene(
        "scene", files=_whole_scenes, rebuild=words_damage(_whole_scenes, _WORDS), read=_read_scene
    ),
    _scene(
        "BSDFs of a scene", files=_scenes, rebuild=words_damage(_scenes, _WORDS), read=_read_bsdfs
    ),
    reader("nesting of a scene", "scene.xml", _scenes, words_damage(_scenes, _WORDS), check_scene),
    _light("light (.exr)", "light.exr", exr_files, image_damage(exr_files, ".exr")),
    _light("light (.hdr)", "light.hdr", _hdr_files, _hdr_damage),
    _light("light (.png)", "light.png", png_files, image_damage(png_files, ".png")),
)
