"""How filtering from afar holds as bumps of a glossy leather grow, and with them its aliasing.

A leather of Fresnel reflectance 0.3 and GGX alpha 0.15 is captured with bumps of several heights
and encoded by the default codec. Spread is the standard deviation of single texels about their mean
over that mean, at 2,000 random pairs of directions: what a picture that takes single texels for
what a pixel sees is off by. What follows are errors of the level of a single texel, relative in the
same way, and its brightness over what it should be, by means of codes and by means of reflectance
that are encoded again; then the error of the codec's own mean against the measured one.

Run `python -m lab.studies.ablations.btf_bumps`; it takes about two minutes of two cores.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.studies.ablations.btf_mipmaps import COMPARED, of_codes
from lab.studies.study import Study
from nacre.array import Floats
from nacre.measured.textures import BONN
from nacre.textures import LatentMap
from nacre.textures.capture import capture, find
from nacre.textures.codecs import load_codec
from nacre.textures.codecs.codec_file import PUBLISHED
from nacre.textures.mipmap import LatentPyramid
from nacre.workflows.encoding import encode

HEIGHTS = (0.0, 0.05, 0.1, 0.2, 0.4, 0.8)
"""Of bumps, over their widths."""


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.options()
    codec = load_codec(PUBLISHED)
    recipe = find("leather12")
    rows = []
    for height in study.few(HEIGHTS):
        family = replace(recipe.generator, depth=height, specular=0.3, roughness=0.15)
        surface = replace(recipe, generator=family).build()
        btf = capture(surface, *BONN.pairs())
        latent = LatentMap(encode(btf, codec).codes, codec, btf.wi, btf.wo, btf.name)
        chosen = np.random.default_rng(9).choice(btf.pair_count, COMPARED, replace=False)
        decode = codec.decoder(btf.wi[chosen], btf.wo[chosen])
        texels = decode(latent.codes.reshape(-1, codec.code_dim).astype(np.float32))
        truth = texels.mean(0)
        measured = btf.texels(slice(None))[:, chosen].mean(0)
        row = [f"{height:g}", f"{relative(texels, truth):.2f}"]
        for kind in ("codes", "reflectance"):
            found = of_codes(decode, LatentPyramid.build(latent, kind).levels[-1])[0, 0]
            row += [f"{relative(found, truth):.3f}", f"{found.mean() / truth.mean():.3f}"]
        rows.append([*row, f"{relative(truth, measured):.3f}"])
        print(f"height {height:g} done", flush=True)
    columns = (
        "height", "spread", "codes", "brightness", "reflectance", "brightness", "codec",
    )  # fmt: skip
    study.table(columns, rows)


def relative(values: Floats, truth: Floats) -> float:
    """Root mean square of differences over the mean."""
    return float(np.sqrt(np.square(values - truth).mean(dtype=float)) / truth.mean(dtype=float))


if __name__ == "__main__":
    main()
