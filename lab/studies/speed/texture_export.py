"""Exported textures: what they cost in time, bytes and error.

The first table has a row for each runner: milliseconds for 512 x 512 pixels of a plane that wears
the texture, on its texels (one level) and from afar (two levels), the largest difference from NumPy
in double precision on the same arrays, and bytes. The second has the arrays' own errors, by nodes
of the grid of directions: mean squared error of factors pi f_r against what the codec decodes,
what half floats and filters with fractions of 8 bits (as graphics cards have) change at most.

`python -m lab.studies.speed.texture_export CODES [--picture OUT.png]`; the picture has a sphere by
the plugin `neuralbtf` at the left, by the exported GLSL at the right.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

import nacre
from lab.studies.study import Study, log
from nacre.array import Floats
from nacre.btf import Btf
from nacre.geometry import cosine_hemisphere, join, split
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.targets.textures import TextureAtlas
from nacre.textures.codecs.basis.colors import join_components
from nacre.textures.factors import CHROMAS, LUMAS, factor, grid_place
from nacre.textures.latent_map import LatentMap
from tests.oracles.texture_runner import TEXTURE_RUNNERS, exported
from tests.oracles.texture_runners.opengl import OpenGl
from tests.oracles.textures import Points, TextureTruth

SIZE = 512
NEAR, FAR = 4.0, 48.0  # repetitions of the texture across the picture
_NODES = 8, 12, 16, 20
_PAIRS, _TEXELS = 2048, 256
_LIGHT = np.array([0.5, 0.4, 0.77])


def plane(repeat: float, texels: int) -> Points:
    """Pixels of a plane, seen from a point above it under one light."""
    y, x = (np.indices((SIZE, SIZE)).reshape(2, -1) + 0.5) / SIZE
    place = np.stack([x - 0.5, 0.5 - y, np.zeros(len(x))], axis=1)
    wo, wi = (
        offset / np.linalg.norm(offset, axis=1, keepdims=True)
        for offset in (np.array([0.0, -0.4, 1.5]) - place, np.array([0.8, 0.9, 1.0]) - place)
    )
    level = np.full(len(x), max(math.log2(repeat * texels / SIZE), 0.0))
    uv = repeat * np.stack([x, y], axis=1)
    return Points(*(np.ascontiguousarray(part, np.float32) for part in (uv, level, wi, wo)))


def executed(texture: Btf, atlas: TextureAtlas) -> list[tuple[str, ...]]:
    """Rows of the first table."""
    name = "texture"
    truth = TextureTruth(atlas.files(name), name, atlas.height, atlas.width)
    points = Points.random(1 << 16, truth.levels)
    expected = truth.evaluate(points)
    pixels = [plane(repeat, max(atlas.height, atlas.width)) for repeat in (NEAR, FAR)]
    files: dict[str, Mapping[str, bytes]] = {}
    rows = []
    for tool, kind in TEXTURE_RUNNERS.members():
        runner = kind()
        if missing := runner.missing():
            log(f"{tool}: {missing} is not installed")
            continue
        if runner.target not in files:
            files[runner.target] = exported(runner.target, texture, atlas, name)
        made = files[runner.target]
        error = np.abs(runner.run(made, name, "eval", points) - expected).max()
        times = [1e3 * len(part.wi) / runner.rate(made, name, part) for part in pixels]
        log(f"{tool}: {times}")
        shown = [f"{time:.0f}" for time in times]
        size = sum(map(len, made.values()))
        rows.append((f"`{runner.target}`", runner.title, *shown, f"{error:.1e}", f"{size:,}"))
    return rows


def arrays(latent: LatentMap) -> list[tuple[str, ...]]:
    """Rows of the second table."""
    random = np.random.default_rng(1)
    u = random.random((4, _PAIRS))
    light, view = (join(cosine_hemisphere(*part)).astype(np.float32) for part in (u[:2], u[2:]))
    codes = latent.codes.reshape(-1, latent.codes.shape[2]).astype(np.float32)
    chosen = np.sort(random.permutation(len(codes))[:_TEXELS])
    decoded = latent.codec.decoder(light, view)(codes[chosen])
    rows = []
    for nodes in _NODES:
        factors = factor(latent, nodes)
        weights = factors.weights[chosen]
        whole = _decoded(weights, _between(factors.functions, nodes, light, view))
        halves = [
            part.astype(np.float16).astype(np.float32) for part in (weights, factors.functions)
        ]
        half = _decoded(halves[0], _between(halves[1], nodes, light, view))
        coarse = _decoded(halves[0], _between(halves[1], nodes, light, view, 256))
        error = 1e4 * float(np.mean(np.square(whole - decoded)))
        changes = [np.abs(part - other).max() for part, other in ((half, whole), (coarse, half))]
        size = 2 * factors.functions.size
        shown = (f"{change:.1e}" for change in changes)
        rows.append((str(nodes), f"{size / 1e6:.1f}", f"{error:.2f}", *shown))
    return rows


def _between(
    functions: Floats, nodes: int, light: Floats, view: Floats, steps: int | None = None
) -> Floats:
    """Functions between nodes; between views, fractions are of so many steps."""
    axes = []
    for which, w in enumerate((light, view)):
        for place in reversed(grid_place(split(w), nodes)):
            low = np.minimum(place.astype(np.intp), nodes - 2)
            after = place - low
            if steps and which:
                after = np.round(after * steps) / steps
            axes.append(((low, 1.0 - after), (low + 1, after)))
    total = np.zeros((len(light), functions.shape[1]))
    for corner in itertools.product(*axes):
        index, share = np.zeros(len(light), np.intp), np.ones(len(light))
        for step, part in corner:
            index, share = index * nodes + step, share * part
        total += share[:, None] * functions[index]
    return total


def _decoded(weights: Floats, functions: Floats) -> Floats:
    luma = weights[:, :LUMAS] @ functions[:, :LUMAS].T
    starts = LUMAS, LUMAS + CHROMAS
    pair = (weights[:, at : at + CHROMAS] @ functions[:, LUMAS:].T for at in starts)
    return join(join_components(luma, *pair))


def picture(texture: Btf, atlas: TextureAtlas, path: Path, size: int = 400) -> float:
    """Write a sphere by the plugin beside one by the exported GLSL; their largest difference."""
    import drjit as dr
    import mitsuba as mi
    from PIL import Image

    options = {"interpolation": "linear", "resolution": atlas.resolution}
    bsdf = texture_bsdf(texture, **options)
    scene = mi.load_dict({"type": "scene", "ball": {"type": "sphere", "bsdf": bsdf}})
    y, x = ((np.indices((size, size)).reshape(2, -1) + 0.5) / size - 0.5) * 2.2
    origin = mi.Point3f(x, np.full_like(x, -3.0), -y)
    si = scene.ray_intersect(mi.Ray3f(origin, mi.Vector3f(0.0, 1.0, 0.0)))
    hit = np.array(si.is_valid())
    si.uv = mi.Point2f(si.uv.x * 8.0, si.uv.y * 4.0)
    light = mi.Vector3f(*(_LIGHT * (1.0, -1.0, 1.0)).tolist())
    wi = si.to_local(light)
    seen = np.array(bsdf.eval(mi.BSDFContext(), si, wi)).T

    # The frame of the texture: y against v, which here runs with the frame's second axis or not.
    sense = np.where(np.array(dr.dot(si.dp_dv, si.sh_frame.t)) < 0.0, -1.0, 1.0)
    directions = []
    for w in (wi, si.wi):
        local = np.array(w).T.copy()
        local[:, 1] *= -sense
        directions.append(local.astype(np.float32))
    uv = np.array(si.uv).T.astype(np.float32)
    points = Points(uv, np.zeros(len(uv), np.float32), *directions)
    files = exported("glsl", texture, atlas, "texture")
    ours = OpenGl().run(files, "texture", "eval", points) * np.maximum(points.wi[:, 2:], 0.0)

    shown = [np.where(hit[:, None], part, 0.0).reshape(size, size, 3) for part in (seen, ours)]
    pixels = np.clip(np.concatenate(shown, axis=1) * 2.5, 0.0, 1.0) ** (1.0 / 2.2)
    Image.fromarray((255.0 * pixels + 0.5).astype(np.uint8)).save(path)
    return float(np.abs(shown[0] - shown[1]).max())


def main() -> None:
    """Print Markdown tables."""
    study = Study(__doc__, __file__)
    study.add_argument("codes", type=Path, help="an encoded texture")
    study.add_argument("--picture", type=Path, help="PNG to write")
    options = study.options()
    texture = nacre.load(options.codes)
    atlas = TextureAtlas.of(texture)
    if options.picture:
        log(f"largest difference from the plugin: {picture(texture, atlas, options.picture):.1e}")
    head = "target", "run by", "one level, ms", "two levels, ms", "largest error, 1/sr", "bytes"
    study.table(head, executed(texture, atlas), note=f"{SIZE} x {SIZE} pixels.")
    if not options.quick:
        head = "nodes", "MB of functions", "MSE x 1e4", "half floats", "8-bit fractions"
        study.table(head, arrays(texture.latent), part="arrays")


if __name__ == "__main__":
    main()
