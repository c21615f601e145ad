"""What to average for a texture that is seen from afar, by codec.

Every capture is encoded by every codec that the package ships, and by those given; a codec of one
set of directions takes captures of these only. Levels are made by means of codes and of reflectance
at some pairs of directions, which is encoded again; for the default codec also by means of
coefficients (codes are then brought closest to them), and of reflectance at fewer and more pairs.

The first table has mean squared errors of reflectance factors at 2,000 random pairs, times 10,000:
of each against means of what the codec decodes, and in brackets of the two filters against means of
what was measured, which is mostly the codec's own error. The second has geometric means of them
over textures and levels by codec, which filter is the default, and whether it is the closer one to
means of what is decoded. Last is the mean over textures of the ratio of brightness to what it
should be.

Run `python -m lab.studies.ablations.btf_mipmaps CAPTURED/unseen/*.npz -o OUT`, with `--codec
FILE...` for further codecs; it takes a minute and a half of one core for the default codec.
"""

from __future__ import annotations

import time
from collections import defaultdict
from pathlib import Path

import numpy as np

from lab.studies.study import Study, geometric_mean, log, mean_square
from nacre.array import Floats
from nacre.btf import Btf
from nacre.formats import load_btf
from nacre.measured.textures.directions import from_degrees
from nacre.mitsuba.preview import write_image
from nacre.textures import LatentMap
from nacre.textures.codecs import load_codec
from nacre.textures.codecs.basis import BasisCodec
from nacre.textures.codecs.basis.posterior import project
from nacre.textures.codecs.codec import Filter, TexelCodec, TexelMap
from nacre.textures.codecs.codec_file import PUBLISHED
from nacre.textures.mipmap import (
    FILTERS,
    PAIRS,
    LatentPyramid,
    filtered_reflectance,
    halved_rows,
)
from nacre.textures.selection import nearest_pair
from nacre.workflows.encoding import encode

COMPARED = 2000
"""Pairs of directions that errors are of."""
COUNTS = 128, 2048
"""Further numbers of pairs that reflectance is averaged at, for the default codec."""
LIGHT, VIEW = (30.0, 0.0), (50.0, 180.0)
VERDICT = (
    *("codec", *(f"means of {by}" for by in FILTERS)),
    *("default", "is it closer", "trials in which it is"),
)
"""Columns of the table by codec."""
EDGE = 96
"""Pixels of a level in pictures."""


def halved_map(values: Floats) -> Floats:
    """The next level of anything that texels have."""
    return np.stack(list(halved_rows(values, len(values))))


def by_coefficients(codec: BasisCodec, codes: Floats) -> list[Floats]:
    """Codes with coefficients closest to means of them, of all levels but the first."""
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


def filtered(latent: LatentMap) -> dict[str, list[Floats]]:
    """Codes of all levels but the first, by what was averaged: the two filters, then others."""
    fixed = getattr(latent.codec, "fixed_directions", False)  # encodes at all of its pairs only
    found: dict[str, list[Floats]] = {}
    for by in FILTERS:
        found[by] = levels_of(latent, by, len(latent.wi) if fixed else PAIRS)
    if isinstance(latent.codec, BasisCodec):
        codes = latent.codes.astype(np.float32)
        found["coefficients"] = by_coefficients(latent.codec, codes)
        for pairs in COUNTS:
            found[f"reflectance at {pairs:,}"] = levels_of(latent, "reflectance", pairs)
    return found


def levels_of(latent: LatentMap, by: Filter, pairs: int) -> list[Floats]:
    """Codes of all levels but the first."""
    began = time.monotonic()
    levels = list(LatentPyramid.build(latent, by, pairs).levels[1:])
    log(f"{latent.name}: by {by} at {pairs:,} pairs in {time.monotonic() - began:.1f} s")
    return levels


def of_codes(decode: TexelMap, codes: Floats) -> Floats:
    """Values of shape (height, width, n, 3)."""
    found = decode(codes.reshape(-1, codes.shape[2]))
    return found.reshape(*codes.shape[:2], *found.shape[1:])


def save_picture(path: Path, rows: list[list[Floats]]) -> None:
    """Levels from left to right of what is given, at the last pair."""
    pictures = [np.concatenate([stretched(p[:, :, -1]) for p in row], axis=1) for row in rows]
    picture = np.concatenate(pictures)
    write_image(picture * (0.9 / max(float(np.quantile(picture, 0.98)), 1e-3)), path)


def stretched(picture: Floats) -> Floats:
    """To :data:`EDGE` pixels, by the nearest."""
    y, x = (np.arange(EDGE) * n // EDGE for n in picture.shape[:2])
    return picture[np.ix_(y, x)]


class Trials:
    """Errors of one codec, each texture and level an entry of a list, by what was averaged."""

    def __init__(self, codec: TexelCodec) -> None:
        self.codec = codec
        self.decoded: dict[str, list[float]] = defaultdict(list)
        self.measured: dict[str, list[float]] = defaultdict(list)
        self.brightness: dict[str, list[float]] = defaultdict(list)

    def add(self, btf: Btf, picture: Path) -> list[list[str]]:
        """Errors of a texture in words, a row for each thing that was averaged; and a picture.

        Rows of the picture are measured, decoded then filtered, by reflectance, by codes.
        """
        latent = LatentMap(encode(btf, self.codec).codes, self.codec, btf.wi, btf.wo, btf.name)
        shown = nearest_pair(btf, *(from_degrees(*angles) for angles in (LIGHT, VIEW)))
        random = np.random.default_rng(9)
        chosen = np.append(random.choice(btf.pair_count, COMPARED, replace=False), shown)
        wi, wo = btf.wi[chosen], btf.wo[chosen]
        decode = self.codec.decoder(wi, wo)
        truths, captured = filtered_reflectance(latent, wi, wo), measured(btf, chosen)
        rows, pictures = [], [captured, truths]
        for kind, levels in filtered(latent).items():
            found = [of_codes(decode, level) for level in levels]
            errors = [mean_square(*pair) for pair in zip(found, truths, strict=True)]
            self.decoded[kind] += errors
            texts = [f"{1e4 * error:.2f}" for error in errors]
            if kind in FILTERS:
                whole = [mean_square(*pair) for pair in zip(found, captured, strict=True)]
                self.measured[kind] += whole
                texts = [f"{t} ({1e4 * w:.1f})" for t, w in zip(texts, whole, strict=True)]
                pictures.append(found)
            self.brightness[kind].append(float(found[-1].mean() / truths[-1].mean()))
            rows.append([btf.name, kind, *texts])
        save_picture(picture, pictures)
        return rows

    def verdict(self) -> list[str]:
        """The default filter against the other one, in words."""
        default = self.codec.filtered_by
        (other,) = (by for by in FILTERS if by != default)
        means = {by: geometric_mean(self.decoded[by]) for by in FILTERS}
        pairs = list(zip(self.decoded[default], self.decoded[other], strict=True))
        closer = sum(a < b for a, b in pairs)
        texts = [
            f"{1e4 * means[by]:.2f} ({1e4 * geometric_mean(self.measured[by]):.1f})"
            for by in FILTERS
        ]
        best = "yes" if means[default] < means[other] else "no"
        return [*texts, default, best, f"{closer} of {len(pairs)}"]


def main() -> None:
    """Print Markdown tables and write a picture of each texture by each codec."""
    study = Study(__doc__, __file__)
    study.add_argument("captures", type=Path, nargs="+")
    study.add_argument("--codec", type=Path, nargs="+", default=[], help="further codecs")
    options = study.options()
    rows, verdicts, brightness = [], [], []
    for path in [*sorted(PUBLISHED.parent.glob("nacre-*.safetensors")), *options.codec]:
        trials = Trials(load_codec(path))
        for capture in study.few(options.captures):
            btf = load_btf(capture)
            found = trials.add(btf, study.output / f"{path.stem}-{btf.name}.png")
            rows += [[path.stem, *row] for row in found]
        name = f"{path.stem} ({trials.codec.kind})"
        verdicts.append([name, *trials.verdict()])
        log(*(f"{c}: {v};" for c, v in zip(VERDICT, verdicts[-1], strict=True)))
        for kind, ratios in trials.brightness.items():
            brightness.append([name, kind, f"{np.mean(ratios):.3f}"])
    levels = [f"level {n}" for n in range(1, len(rows[0]) - 2)]
    study.table(("codec", "texture", "mean of", *levels), rows)
    study.table(VERDICT, verdicts, "by codec")
    study.table(("codec", "mean of", "brightness of the last level"), brightness, "brightness")


if __name__ == "__main__":
    main()
