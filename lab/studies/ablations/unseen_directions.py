"""Whole directions that the default codec of textures has never seen.

A codec is trained without 24 of Bonn's 151 directions, as lights and as views: one in each 60
degrees of four rings, so that the dome keeps its symmetry. It is compared with one that was trained
on all directions. Both encode the unseen captures from the pairs of the 127 directions, and their
errors are of the pairs that have one of the 24.

Run `python -m lab.studies.ablations.unseen_directions CAPTURED --model MODEL` with the folder that
`nacre btf capture --all` makes. It takes as long as a training.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lab.studies.study import Study, geometric_mean, progress
from nacre.array import Floats
from nacre.btf import Btf, TableBtf
from nacre.formats import load_btf
from nacre.measured.textures import BONN
from nacre.textures.codecs.basis import BasisCodec, BasisRecipe
from nacre.textures.codecs.codec import TexelCodec, TrainingRun, on_all_cores
from nacre.textures.codecs.codec_file import load_codec

RINGS = (23.5, 37.5, 52.5, 67.5)
"""Polar angles in degrees, a third to a half of whose directions are held out."""
TEXELS = 256
"""Of each unseen texture."""


def held_out() -> Floats:
    """The directions that are kept from training, shape (24, 3)."""
    found, first = [], 0
    directions = BONN.directions
    for polar, count, _ in BONN.rings:
        if polar in RINGS:
            found.append(directions[first : first + count : count // 6])
        first += count
    return np.concatenate(found)


def has(directions: Floats, wi: Floats, wo: Floats) -> npt.NDArray[np.bool_]:
    """Which pairs have one of some directions."""
    either = [(w @ directions.T).max(1) > 1.0 - 1e-6 for w in (wi, wo)]
    return either[0] | either[1]


def without(path: Path, directions: Floats) -> Btf:
    """A texture of the pairs that have none of some directions."""
    texture = load_btf(path)
    kept = ~has(directions, texture.wi, texture.wo)
    values = texture.texels(slice(None))[:, kept].astype(np.float16)
    shape = texture.height, texture.width, *values.shape[1:]
    return TableBtf(values.reshape(shape), texture.wi[kept], texture.wo[kept], texture.name)


def error(codec: TexelCodec, texture: Btf, directions: Floats) -> float:
    """Mean squared error at the pairs that have one of some directions, coded from the others."""
    random = np.random.default_rng(0)
    chosen = np.sort(random.choice(texture.texel_count, TEXELS, replace=False))
    texels = texture.texels(chosen)
    out = has(directions, texture.wi, texture.wo)
    encode = on_all_cores(codec, codec.encoder(texture.wi[~out], texture.wo[~out]))
    decode = on_all_cores(codec, codec.decoder(texture.wi[out], texture.wo[out]))
    found = decode(encode(texels[:, ~out]))
    return float(np.square(found - texels[:, out]).mean())


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("captured", type=Path, help="folder with train/ and unseen/")
    study.add_argument("--model", type=Path, required=True, help="trained on all directions")
    options = study.options()
    directions = held_out()
    files = sorted((options.captured / "train").glob("*.npz"))

    run = TrainingRun(files, partial(without, directions=directions), progress=progress)
    parted = BasisCodec.train(run, BasisRecipe(seed=options.seed))
    whole = load_codec(options.model)
    rows, ratios = [], []
    for path in sorted((options.captured / "unseen").glob("*.npz")):
        texture = load_btf(path)
        with_all, with_some = (error(codec, texture, directions) for codec in (whole, parted))
        ratios.append(with_some / with_all)
        rows.append((texture.name, f"{1e4 * with_all:.1f}", f"{1e4 * with_some:.1f}"))
    study.table(
        ("MSE x 1e4", "all directions", "without 24"),
        rows,
        note=f"geometric mean of the ratios: {geometric_mean(ratios):.3f}",
    )


if __name__ == "__main__":
    main()
