"""What to average for a texture that is seen from afar.

Every capture is encoded by the default codec, and levels are made by means of codes, by means of
coefficients (codes are then brought closest to them), and of reflectance at some numbers of pairs
of directions, which is encoded again. What is printed are mean squared errors of reflectance
factors at 2,000 random pairs, times 10,000: of each against means of what the codec decodes, and
of the last against means of what was measured, in brackets, which is mostly the codec's own error.
Then the mean over textures of the ratio of brightness to what it should be.

Run `python -m studies.ablations.btf_mipmaps CAPTURED/unseen/*.npz -o OUT`; it takes a minute and a
half of one core.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.formats import load_btf
from nacre.measured.textures.directions import from_degrees
from nacre.render.preview import write_image
from nacre.textures import LatentMap
from nacre.textures.codecs import load_codec
from nacre.textures.codecs.basis import BasisCodec
from nacre.textures.codecs.basis.posterior import project
from nacre.textures.codecs.codec import TexelMap
from nacre.textures.codecs.codec_file import PUBLISHED
from nacre.textures.mipmap import LatentPyramid, filtered_reflectance, halved_rows
from nacre.textures.selection import nearest_pair
from nacre.workflows.encoding import encode
from studies.study import Study, mean_square

PAIRS = 2000
LIGHT, VIEW = (30.0, 0.0), (50.0, 180.0)
EDGE = 96
"""Pixels of a level in pictures."""


def halved_map(values: Floats) -> Floats:
    """The next level of anything that texels have."""
    return np.stack(list(halved_rows(values, len(values))))


def by_coefficients(latent: LatentMap) -> list[Floats]:
    """Codes with coefficients closest to means of them, of all levels but the first."""
    codec, codes = latent.codec, latent.codes.astype(np.float32)
    assert isinstance(codec, BasisCodec)
    shape = codes.shape[:2]
    coefficients = codec.decode(codes.reshape(-1, codec.code_dim)).reshape(*shape, -1)
    levels = []
    while codes.size > codec.code_dim:
        codes, coefficients = halved_map(codes), halved_map(coefficients)
        wanted = coefficients.reshape(-1, coefficients.shape[2])
        found = project(codes.reshape(-1, codec.code_dim), wanted, codec.decode, 2)
        levels.append(found.reshape(codes.shape))
    return levels


def measured(btf: Btf, chosen: np.ndarray) -> list[Floats]:
    """Means of measured values, of all levels but the first."""
    values = btf.texels(slice(None))[:, chosen].reshape(btf.height, btf.width, len(chosen), 3)
    levels = []
    while values.shape[:2] != (1, 1):
        values = halved_map(values)
        levels.append(values)
    return levels


def main() -> None:
    """Print a Markdown table and write a picture of each texture."""
    study = Study(__doc__, __file__)
    study.add_argument("captures", type=Path, nargs="+")
    options = study.options()
    codec = load_codec(PUBLISHED)
    assert isinstance(codec, BasisCodec)
    rows, brightness = [], []
    for path in options.captures:
        btf = load_btf(path)
        codes = encode(btf, codec).codes
        latent = LatentMap(codes, codec, btf.wi, btf.wo, btf.name)
        random = np.random.default_rng(9)
        shown = nearest_pair(btf, *(from_degrees(*angles) for angles in (LIGHT, VIEW)))
        chosen = np.append(random.choice(btf.pair_count, PAIRS, replace=False), shown)
        wi, wo = btf.wi[chosen], btf.wo[chosen]
        decode = codec.decoder(wi, wo)
        truths, captured = filtered_reflectance(latent, wi, wo), measured(btf, chosen)
        kinds: dict[str, list[Floats]] = {}
        kinds["codes"] = list(LatentPyramid.build(latent, "codes").levels[1:])
        kinds["coefficients"] = by_coefficients(latent)
        for pairs in (128, 512, 2048):
            began = time.monotonic()
            pyramid = LatentPyramid.build(latent, "reflectance", pairs)
            seconds = time.monotonic() - began
            kinds[f"reflectance at {pairs:,}"] = list(pyramid.levels[1:])
        print(f"{btf.name}: reflectance at {pairs:,} pairs in {seconds:.1f} s", flush=True)
        for kind, levels in kinds.items():
            decoded = [of_codes(decode, level) for level in levels]
            errors = [mean_square(a, b) for a, b in zip(decoded, truths, strict=True)]
            texts = [f"{1e4 * error:.2f}" for error in errors]
            if kind == "reflectance at 512":
                whole = [mean_square(a, b) for a, b in zip(decoded, captured, strict=True)]
                texts = [f"{t} ({1e4 * w:.1f})" for t, w in zip(texts, whole, strict=True)]
                save_picture(study.output / f"{btf.name}.png", captured, truths, kinds, decode)
            rows.append([btf.name, kind, *texts])
            brightness.append((kind, decoded[-1].mean() / truths[-1].mean()))
    levels = [f"level {n}" for n in range(1, len(rows[0]) - 1)]
    study.table(("texture", "mean of", *levels), rows)
    for kind in kinds:
        ratios = [ratio for name, ratio in brightness if name == kind]
        print(f"brightness of the last level by {kind}: {np.mean(ratios):.3f}")


def of_codes(decode: TexelMap, codes: Floats) -> Floats:
    """Values of shape (height, width, n, 3)."""
    found = decode(codes.reshape(-1, codes.shape[2]))
    return found.reshape(*codes.shape[:2], *found.shape[1:])


def save_picture(
    path: Path,
    captured: list[Floats],
    truths: list[Floats],
    kinds: dict[str, list[Floats]],
    decode: TexelMap,
) -> None:
    """Levels from left to right; measured, decoded then filtered, by reflectance, by codes."""
    by_kind = [[of_codes(decode, c) for c in kinds[k]] for k in ("reflectance at 512", "codes")]
    rows = [
        np.concatenate([stretched(level[:, :, -1]) for level in levels], axis=1)
        for levels in (captured, truths, *by_kind)
    ]
    picture = np.concatenate(rows)
    write_image(picture * (0.9 / max(float(np.quantile(picture, 0.98)), 1e-3)), path)


def stretched(picture: Floats) -> Floats:
    """To :data:`EDGE` pixels, by the nearest."""
    y, x = (np.arange(EDGE) * n // EDGE for n in picture.shape[:2])
    return picture[np.ix_(y, x)]


if __name__ == "__main__":
    main()
