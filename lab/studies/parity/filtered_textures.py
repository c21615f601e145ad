"""Textures of few bytes per texel in three.js, against what nacre decodes.

Mean squared errors x 1e4 of factors pi f_r, at texels and cosine-distributed directions: as the
export states it; as the exported shader computes it in Chromium at the same points; the same
between texels, against means of the four texels' reflectance; and on level 2, against means of
4 x 4 texels. FLIP is that of pictures of a plane, of a pixel for each texel, under two lights, by
the exported material. The last column is what a page loads.

`python -m lab.studies.parity.filtered_textures CODES... [-o OUT]`; pictures in OUT have a row for
each texture: what nacre decodes, then each size.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from PIL import Image

import nacre
from lab.studies.study import Study, log
from nacre.array import Floats
from nacre.btf import Btf
from nacre.color import tone_map
from nacre.metrics.ldr_flip import displayed_flip
from nacre.targets.textures import FilteredTexture, TextureAtlas
from nacre.targets.textures.accuracy import compared_at, mean_squared_error
from nacre.targets.textures.shader_texture import ShaderTexture
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.latent_map import LatentMap
from tests.oracles.texture_runner import exported
from tests.oracles.texture_runners.three import ThreeWebGl, plane
from tests.oracles.textures import Points

NAME = "texture"
SIZES = 4, 8, 16, 32
LIGHTS = (0.4, 0.3, 0.866), (-0.75, 0.2, 0.63)
EXPOSURE = 2.0
LEVEL = 2
_WHERE = "at texels", "between", f"level {LEVEL}"


def reference(latent: LatentMap, points: Points, width: int) -> Floats:
    """Factors at points: means over squares of `width` texels around each, from their corners."""
    height, columns, _ = latent.codes.shape
    place = points.uv.astype(np.float64) * (columns, height) - 0.5 * width
    low = np.floor(place + 1e-4).astype(int)
    after = place - low
    total = np.zeros((len(points.uv), 3))
    for dy, dx in np.ndindex(width + 1, width + 1):
        share = np.ones(len(total))
        for axis, step in enumerate((dx, dy)):
            inner = 1.0 if 0 < step < width else 0.0
            fraction = after[:, axis]
            share *= inner or (1.0 - fraction if step == 0 else fraction)
        at = (low[:, 1] + dy) % height, (low[:, 0] + dx) % columns
        total += (share / width**2)[:, None] * _decoded(latent, latent.codes[at], points)
    return total


def _decoded(latent: LatentMap, codes: Floats, points: Points) -> Floats:
    """Factors of one code for each point; directions repeat for each place."""
    _, wi, wo = compared_at(latent)
    decode = on_all_cores(latent.codec, latent.codec.decoder(wi, wo))
    return decode(codes[:: len(wi)].astype(np.float32)).reshape(-1, 3)


def points(latent: LatentMap, level: int, between: bool) -> Points:
    """Places, each at the same pairs of directions: on level 0 those of the stated error."""
    texels, wi, wo = compared_at(latent)
    height, width, _ = latent.codes.shape
    step = 1 << level
    y, x = (step * (part // step + 0.5) for part in np.divmod(texels, width))
    uv = np.stack([x / width, y / height], axis=1)
    if between:
        uv += 0.5 / np.array([width, height])
    places, pairs = len(texels), len(wi)
    return Points(
        *(
            np.ascontiguousarray(part, np.float32)
            for part in (
                np.repeat(uv, pairs, 0),
                np.full(places * pairs, level),
                np.tile(wi, (places, 1)),
                np.tile(wo, (places, 1)),
            )
        )
    )


def errors(files: Mapping[str, bytes], latent: LatentMap) -> list[float]:
    """Mean squared errors in Chromium; see :data:`_WHERE`."""
    found = []
    for level, between in ((0, False), (0, True), (LEVEL, False)):
        at = points(latent, level, between)
        seen = np.pi * ThreeWebGl().run(files, NAME, "eval", at)
        # Between texels, a square of one texel covers a quarter of each of the four.
        expected = reference(latent, at, 1 << level)
        found.append(float(np.mean(np.square(seen - expected))))
    return found


def decoded_pictures(texture: Btf) -> list[Floats]:
    """From above, under each light, linear; (height, width, 3)."""
    up = np.array([[0.0, 0.0, 1.0]], np.float32)
    lights = (np.array([light], np.float32) / np.linalg.norm(light) for light in LIGHTS)
    return [
        texture.at_directions(np.float32(wi), up).images(slice(None))[0] * wi[0, 2] / np.pi
        for wi in lights
    ]


def exported_pictures(files: Mapping[str, bytes], texture: Btf) -> list[Floats]:
    """The same by the exported material."""
    size = texture.width, texture.height
    options = {"repeat": 1.0, "samples": 0}
    return [
        plane(files, NAME, "webgl", size, light=list(light), **options)[..., :3] for light in LIGHTS
    ]


def main() -> None:
    """Make the table and the pictures."""
    study = Study(__doc__, __file__)
    study.add_argument("codes", nargs="+", help="encoded textures: paths or names")
    options = study.options()
    rows, sheet = [], []
    for path in options.codes:
        texture = nacre.load(path)
        latent = texture.latent
        truth = decoded_pictures(texture)
        strip = [truth]
        made: dict[str, ShaderTexture] = {
            str(size): FilteredTexture.of(texture, size) for size in study.few(SIZES)
        }
        made["256"] = TextureAtlas.of(texture)
        for size, atlas in made.items():
            files = exported("three", texture, atlas, NAME)
            stated = mean_squared_error(atlas, latent)
            found = [f"{1e4 * error:.2f}" for error in (stated, *errors(files, latent))]
            pictures = exported_pictures(files, texture)
            scale = EXPOSURE * np.pi
            looks = [
                displayed_flip(scale * one, scale * other)
                for one, other in zip(truth, pictures, strict=True)
            ]
            strip.append(pictures)
            loaded = sum(map(len, files.values())) / 1e6
            rows.append((texture.name, size, *found, f"{np.mean(looks):.3f}", f"{loaded:.1f}"))
            log(" ".join(rows[-1]))
        sheet += [np.concatenate([shown[k] for shown in strip], axis=1) for k in range(len(LIGHTS))]
    wide = max(row.shape[1] for row in sheet)
    padded = [np.pad(row, ((0, 0), (0, wide - row.shape[1]), (0, 0))) for row in sheet]
    pixels = tone_map(EXPOSURE * np.pi * np.concatenate(padded))
    image = np.clip(255.0 * pixels + 0.5, 0.0, 255.0).astype(np.uint8)
    Image.fromarray(image).save(study.output / "textures.png")
    study.table(("texture", "bytes", "stated", *_WHERE, "FLIP", "MB loaded"), rows)


if __name__ == "__main__":
    main()
