"""In which space texels that are near each other look alike.

Random texels of all captures are encoded. Of some of them the ten nearest others are found by what
was measured, as square roots of reflectance or reflectance itself, and by codes, by codes scaled to
equal spread, by coefficients, by what codes decode to and by `nacre.textures.embedding`. The table
has the fraction of the ten that both find, the fraction of nearest texels that are the same, and
how much farther off than the truly nearest one that texel is which was found, by measured distance.

Run `python -m lab.studies.ablations.texel_distances CAPTURED` with the
folder that `nacre btf capture --all` makes. It takes three minutes of two cores.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lab.studies.study import Study
from nacre.array import Floats
from nacre.formats import load_btf
from nacre.measured.textures import BONN
from nacre.textures.codecs.basis import BasisCodec
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.codecs.codec_file import PUBLISHED, load_codec
from nacre.textures.selection import random_texels

TEXELS, PAIRS, EVERY, NEAREST = 24, 2000, 5, 10
"""Texels of each capture, pairs of directions compared; one in five texels is asked for."""


def distances(values: Floats) -> Floats:
    """From some texels to all, infinite to themselves, shape (n / 5, n)."""
    values = values.reshape(len(values), -1)
    asked = np.arange(0, len(values), EVERY)
    squares = np.square(values).sum(1)
    found = squares[asked, None] + squares - 2.0 * values[asked] @ values.T
    found[np.arange(len(asked)), asked] = np.inf
    return np.sqrt(np.maximum(found, 0.0))


def agreement(truth: Floats, found: Floats) -> tuple[float, float, float]:
    """Fraction of nearest texels that are the same, of the very nearest, and how much farther."""
    true, other = (np.argsort(d, axis=1)[:, :NEAREST] for d in (truth, found))
    shared = [len(set(a) & set(b)) / NEAREST for a, b in zip(true, other, strict=True)]
    rows = np.arange(len(truth))
    ratios = truth[rows, other[:, 0]] / truth[rows, true[:, 0]]
    same = float((true[:, 0] == other[:, 0]).mean())
    return float(np.mean(shared)), same, float(np.exp(np.log(ratios).mean()))


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("captured", type=Path, help="folder with train/ and unseen/")
    options = study.options()
    codec = load_codec(PUBLISHED)
    assert isinstance(codec, BasisCodec)
    wi, wo = BONN.pairs()
    some = np.sort(np.random.default_rng(1).choice(len(wi), PAIRS, replace=False))
    encode = on_all_cores(codec, codec.encoder(wi, wo))
    coded, seen = [], []
    for path in sorted(options.captured.glob("*/*.npz")):
        texture = load_btf(path)
        texels = texture.texels(random_texels(texture, TEXELS, np.random.default_rng(0)))
        coded.append(encode(texels))
        seen.append(np.maximum(texels[:, some], 0.0))
    codes, measured = np.concatenate(coded), np.concatenate(seen)
    decoded = on_all_cores(codec, codec.decoder(wi[some], wo[some]))(codes)
    spaces = {
        "codes": codes,
        "codes, scaled": codes / codes.std(0),
        "coefficients": codec.decode(codes),
        "decoded, 2000 pairs": decoded,
        "decoded, roots": np.sqrt(decoded),
        "nacre.textures.embedding": codec.embedding(*BONN.pairs())(codes),
    }
    truths = {"roots": distances(np.sqrt(measured)), "reflectance": distances(measured)}
    rows = []
    for name, values in spaces.items():
        found = distances(values)
        numbers = [agreement(truth, found) for truth in truths.values()]
        rows.append((name, *(f"{100 * a:.0f} %, {100 * b:.0f} %, {c:.3f}" for a, b, c in numbers)))
    study.table(("nearest by", *(f"measured {name}" for name in truths)), rows)


if __name__ == "__main__":
    main()
