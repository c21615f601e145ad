"""Textures made larger, and mixtures of two: seams, what distances to take, and what is between.

For every encoded texture a texture of three times its edges is made that tiles, by quilting, by
random patches side by side, and by random patches whose overlaps are blended. What is printed of
each is the contrast of its seams: root mean square of differences of neighbors across them over
that of all other neighbors, in roots of reflectance factors at directions that quilting does not
look at; with blended overlaps, differences within these over those outside. Then, for some ways to
measure how unlike two texels are: rank correlation with their difference over 500 other pairs of
directions, and contrast of seams when quilting goes by it. Last, the middle of each texture and the
next: its contrast over the mean of the two materials', its mean brightness over the mean of theirs,
and its relative error against the mean of decoded reflectance.

Run `python -m lab.studies.ablations.btf_synthesis CODES/*.safetensors -o OUT`; captures of 128 x
128 texels take a minute and a quarter of one core.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter
from scipy.stats import spearmanr

from lab.studies.study import Study
from nacre.array import Floats
from nacre.measured.textures.directions import from_degrees
from nacre.mitsuba.preview import write_image
from nacre.textures import LatentMap, NeuralBtf, load_latent_map
from nacre.textures.synthesis import blend, synthesize
from nacre.textures.synthesis.quilted_map import texel_features
from nacre.textures.synthesis.quilting import Quilting, Sources, quilt
from nacre.textures.synthesis.seams import seam_contrast, seams

LIGHTS = ((30, 0), (60, 90), (60, 200), (10, 45))
VIEWS = ((0, 0), (30, 180), (50, 0), (10, 225))
SCALE = 3
PAIRS = 500
TEXELS = 1500


def roots(latent: LatentMap, wi: Floats, wo: Floats) -> Floats:
    """Roots of reflectance factors, shape (height, width, 3 n)."""
    values = NeuralBtf(latent, (wi, wo)).texels(slice(None))
    return np.sqrt(np.maximum(values, 0.0)).reshape(*latent.codes.shape[:2], -1)


def random_patches(
    shape: tuple[int, int], edge: int, patch: int, random: np.random.Generator
) -> Sources:
    """Patches from anywhere, side by side."""
    sources = np.empty((edge, edge), np.intp)
    for y, x in np.ndindex(-(-edge // patch), -(-edge // patch)):
        window = sources[y * patch : (y + 1) * patch, x * patch : (x + 1) * patch]
        top, left = (random.integers(n - patch + 1) for n in shape)
        rows, columns = (np.arange(n) for n in window.shape)
        window[:] = (top + rows)[:, None] * shape[1] + left + columns
    return sources


def blended_patches(
    values: Floats, edge: int, patch: int, overlap: int, random: np.random.Generator
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Patches from anywhere, mixed where they overlap, and where that is."""
    ramp = np.minimum(np.arange(1, patch + 1), np.arange(patch, 0, -1)) / (overlap + 1.0)
    window = np.minimum(ramp, 1.0)[:, None] * np.minimum(ramp, 1.0)
    size = edge + patch
    sums, weights = np.zeros((size, size, values.shape[2])), np.zeros((size, size, 1))
    for y in range(0, edge, patch - overlap):
        for x in range(0, edge, patch - overlap):
            top, left = (random.integers(n - patch + 1) for n in values.shape[:2])
            place = np.s_[y : y + patch, x : x + patch]
            sums[place] += window[..., None] * values[top : top + patch, left : left + patch]
            weights[place] += window[..., None]
    inside = np.arange(edge) % (patch - overlap)
    mixed = inside < overlap
    return (sums / np.maximum(weights, 1e-9))[:edge, :edge], mixed[:, None] | mixed


def seam_ratios(latent: LatentMap, output: Path) -> tuple[list[str], Floats]:
    """A row of the first table; a picture is written. Also the input's roots, for the second."""
    wi, wo = (from_degrees(*np.transpose(angles)).astype(np.float32) for angles in (LIGHTS, VIEWS))
    seen = roots(latent, wi, wo)
    rows, columns, _ = seen.shape
    flat = seen.reshape(rows * columns, -1)
    edge, random = SCALE * rows, np.random.default_rng(0)
    made = synthesize(latent, edge, edge, tile=True)
    patch, overlap = made.settings.patch, made.settings.overlap
    naive = random_patches((rows, columns), edge, patch, random)
    mixed, where = blended_patches(seen, edge, patch, overlap, random)
    ratios = []
    for sources, periodic in ((made.sources, made.settings.periodic), (naive, False)):
        edges = seams(sources, rows, columns, periodic=periodic, tile=True)
        ratios.append(seam_contrast(flat[sources], edges, tile=True).ratio)
    ratios.append(seam_contrast(mixed, (where, where), tile=False).ratio)
    pictures = [flat[made.sources], flat[naive], mixed]
    line = np.ones((edge, 4, 3))
    source = np.ones((edge, columns, 3))
    source[:rows] = seen[..., :3] ** 2
    parts = [source, *(part for picture in pictures for part in (line, picture[..., :3] ** 2))]
    picture = np.concatenate(parts, axis=1)
    write_image(picture * (0.9 / max(np.quantile(source[:rows], 0.98), 1e-3)), output)
    used = f"{made.used:.2f}"
    return [latent.name, str(patch), *(f"{r:.2f}" for r in ratios if r is not None), used], seen


def distances(latent: LatentMap, seen: Floats) -> dict[str, tuple[float, float]]:
    """For some kinds of features: rank correlation, and contrast of seams."""
    random = np.random.default_rng(5)
    chosen = random.choice(len(latent.wi), min(PAIRS, len(latent.wi)), replace=False)
    codes = latent.codes.astype(np.float32)
    squares = np.square(roots(latent, latent.wi[chosen[:64]], latent.wo[chosen[:64]]))
    flat = squares.reshape(-1, squares.shape[2]) - squares.mean((0, 1))
    strongest = np.linalg.svd(flat[:: max(1, len(flat) // 4096)], full_matrices=False)[2][:16]
    features = texel_features(latent)
    kinds = {
        "codes": codes - codes.mean((0, 1)),
        "codes over their deviations": (codes - codes.mean((0, 1))) / (codes.std((0, 1)) + 1e-6),
        "16 components of reflectance": (flat @ strongest.T).reshape(*codes.shape[:2], -1),
        "4 components of roots": features[..., :4],
        "16 components of roots": features,
    }
    some = random.choice(latent.codes.size // codes.shape[2], 2 * TEXELS, replace=False)
    a, b = some[:TEXELS], some[TEXELS:]
    truth = roots(latent, latent.wi[chosen], latent.wo[chosen]).reshape(-1, 3 * len(chosen))
    apart = np.square(truth[a] - truth[b]).sum(1)
    found = {}
    rows, columns = codes.shape[:2]
    patch = min(32, rows // 2)
    settings = Quilting(patch, 3 * patch // 8, tile=True)
    for name, values in kinds.items():
        flat = values.reshape(rows * columns, -1)
        sources = quilt(features, SCALE * rows, SCALE * columns, settings)
        edges = seams(sources, rows, columns, periodic=False, tile=True)
        ratio = seam_contrast(seen.reshape(rows * columns, -1)[sources], edges, tile=True).ratio
        rank = spearmanr(np.square(flat[a] - flat[b]).sum(1), apart).statistic
        found[name] = (float(rank), ratio or 0.0)
    return found


def middles(first: LatentMap, second: LatentMap) -> list[str]:
    """A row of the last table, by both ways to blend."""
    random = np.random.default_rng(2)
    chosen = random.choice(len(first.wi), min(64, len(first.wi)), replace=False)
    wi, wo = first.wi[chosen], first.wo[chosen]
    half = np.full(first.codes.shape[:2], 0.5, np.float32)
    ends = [np.square(roots(latent, wi, wo)) for latent in (first, second)]
    truth = sum(ends) / 2.0

    def contrast(values: Floats) -> float:
        return float(np.square(values - uniform_filter(values, (33, 33, 1))).mean() ** 0.5)

    before = np.mean([contrast(values) for values in ends])
    row = [f"{first.name}, {second.name}", f"{contrast(truth) / before:.2f}"]
    for kept in (False, True):
        mixed = np.square(roots(blend(first, second, half, keep_contrast=kept), wi, wo))
        error = np.sqrt(np.square(mixed - truth).mean() / np.square(truth).mean())
        row += [f"{contrast(mixed) / before:.2f}", f"{mixed.mean() / truth.mean():.2f}"]
        row += [f"{error:.2f}"] if not kept else []
    return row


def main() -> None:
    """Print three Markdown tables and write pictures."""
    study = Study(__doc__, __file__)
    study.add_argument("codes", type=Path, nargs="+", help="encoded square textures")
    options = study.options()
    maps = [load_latent_map(path) for path in options.codes]
    rows, kinds = [], []
    for latent in maps:
        row, seen = seam_ratios(latent, study.output / f"{latent.name}.png")
        rows.append(row)
        kinds.append(distances(latent, seen))
    columns = "texture", "patch", "quilted", "side by side", "blended", "fraction of the input used"
    study.table(columns, rows, "seams")
    means = [
        (name, *(f"{np.mean([kind[name][i] for kind in kinds]):.3f}" for i in (0, 1)))
        for name in kinds[0]
    ]
    study.table(
        ("mean of all textures", "rank correlation", "contrast of seams"), means, "distances"
    )
    wide = np.tile(np.linspace(0.0, 1.0, 256, dtype=np.float32), (128, 1))
    wi, wo = from_degrees([30.0], [0.0]), from_degrees([0.0], [0.0])
    mixed, strips = [], []
    for first, second in zip(maps, [*maps[1:], maps[0]], strict=True):
        mixed.append(middles(first, second))
        strips.append(
            [
                roots(blend(first, second, wide, keep_contrast=kept), wi, wo) ** 2
                for kept in (False, True)
            ]
        )
    write_image(
        np.concatenate([np.concatenate(pair, 1) for pair in strips]), study.output / "blends.png"
    )
    columns = "middle of", "contrast of mean reflectance", "of mean codes", "brightness", "error"
    study.table((*columns, "contrast kept", "brightness"), mixed, "blends")


if __name__ == "__main__":
    main()
