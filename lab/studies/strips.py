"""The two strips of pictures of the README, of self-made materials only.

`python -m lab.studies.strips -o docs/images` writes `strip-reflectance.jpg` (measured, neural,
difference: the car paint of `nacre demo`, tabulated as a MERL file and fitted) and
`strip-texture.jpg` (reference, decoded, difference: a virtual capture of leather, encoded by the
default codec, on a cylinder). Both are path traced. It takes some minutes on two cores; `--quick`
makes noisy ones.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import nacre
from lab.studies.study import Study, progress
from nacre.array import Floats
from nacre.cli.demo import _MATERIAL as PAINT
from nacre.figures.difference_sheet import CELL_PIXELS, Row, difference_sheet
from nacre.figures.page import Bytes, scale_end
from nacre.measured.textures import UTIA
from nacre.measuring.virtual import MitsubaBrdf
from nacre.metrics.ldr_flip import displayed_flip
from nacre.mitsuba.preview import render_preview, render_scene, write_bytes
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.mitsuba.textures.scene import describe_texture_scene, texture_scale
from nacre.textures import LatentMap
from nacre.textures.capture import capture, find
from nacre.textures.codecs import load_codec
from nacre.textures.codecs.codec_file import PUBLISHED
from nacre.workflows.encoding import encode

TEXELS, REPEAT = 48, 2


def reflectance(spp: int, seed: int) -> Bytes:
    """A table of a Mitsuba material, and the network fitted to it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "paint.binary"
        nacre.save(MitsubaBrdf(PAINT, "virtual car paint"), path)
        measured = nacre.load(path)
    neural = nacre.fit(measured, nacre.Recipe.preset("standard", seed=seed), progress=progress)
    views = [render_preview(m, size=CELL_PIXELS, spp=spp, seed=seed) for m in (measured, neural)]
    return strip(views, ("Measured", "Neural"))


def texture(spp: int, seed: int, texels: int) -> Bytes:
    """A virtual capture, and what the default codec makes of it."""
    btf = capture(
        find("leather12").build(), *UTIA.pairs(), texels, samples=32, seed=seed, progress=progress
    )
    codec = load_codec(PUBLISHED)
    codes = encode(btf, codec, progress=progress).codes
    views = []
    for made in (btf, LatentMap(codes, codec, btf.wi, btf.wo, btf.name)):
        to_uv = texture_scale("cylinder", REPEAT, 1.0)
        bsdf = texture_bsdf(made, progress, to_uv=to_uv)
        scene = describe_texture_scene(bsdf, "cylinder", size=(CELL_PIXELS, CELL_PIXELS))
        views.append(render_scene(scene, spp, seed))
    return strip(views, ("Reference texture", "Decoded"))


def strip(views: list[Floats], titles: tuple[str, str]) -> Bytes:
    """Two renderings of one scene, and their FLIP error."""
    errors = displayed_flip(*views)
    scale = scale_end([errors])
    reference, model = views
    row = Row(reference, model, errors, smooth=True)
    return difference_sheet([row], scale, f"Difference (FLIP, 0 to {scale:g})", titles=titles)


def main() -> None:
    """Write both strips."""
    study = Study(__doc__, __file__)
    options = study.options()
    spp, texels = (16, 24) if options.quick else (256, TEXELS)
    write_bytes(reflectance(spp, options.seed), study.output / "strip-reflectance.jpg")
    write_bytes(texture(spp // 4, options.seed, texels), study.output / "strip-texture.jpg")


if __name__ == "__main__":
    main()
