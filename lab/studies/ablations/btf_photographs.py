"""How many photographs of a flat sample the default codec needs, and which.

Unseen captures are encoded from some of their pairs of directions: drawn at random, far from one
another, planned (`nacre btf plan`), with the light at the camera as of a phone, and with a quarter
of planned pairs among such. Errors are of all pairs. Then the planned ones are written as PNG
images of 8 bits, as a camera would, and read again: exposed so that white is the brightest value,
and at a quarter of that.

Run `python -m lab.studies.ablations.btf_photographs CAPTURED -o FOLDER`
with the folder that `nacre btf capture --all` makes. It takes five minutes of two cores.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from PIL import Image

from lab.studies.study import Study
from nacre.array import Floats
from nacre.btf import Btf
from nacre.figures.plot import write_plot
from nacre.formats import load_btf
from nacre.measured.textures import BONN, load_photographs
from nacre.textures.codecs.basis import BasisCodec
from nacre.textures.codecs.codec import TexelMap, on_all_cores
from nacre.textures.codecs.codec_file import PUBLISHED, load_codec
from nacre.textures.plan import CANDIDATES, informative, write_plan
from nacre.textures.selection import random_texels

COUNTS = 25, 50, 100, 200, 500, 1000, 2000
TEXELS = 64
"""Of each texture, at random."""
SEEDS = 3
"""Of random pairs; the mean of their errors is shown."""
PNG_COUNTS = 100, 500

Indices = npt.NDArray[np.intp]
Texels = dict[str, Floats]


def far_apart(wi: Floats, wo: Floats, count: int) -> Indices:
    """Pairs of directions, each as far from those before as any (Gonzalez 1985)."""
    points = np.concatenate([wi, wo], axis=1)
    distances, found = np.full(len(points), np.inf), [0]
    while len(found) < count:
        distances = np.minimum(distances, np.square(points - points[found[-1]]).sum(1))
        found.append(int(distances.argmax()))
    return np.array(found)


def choices(codec: BasisCodec) -> Iterator[tuple[str, int, Indices]]:
    """Ways to choose, how many, and the pairs of Bonn's directions chosen."""
    wi, wo = BONN.pairs()
    most = max(COUNTS)
    some = np.random.default_rng(0).choice(len(wi), CANDIDATES, replace=False)
    planned = some[informative(codec, wi[some], wo[some], most)]
    apart = some[far_apart(wi[some], wo[some], most)]
    same = np.flatnonzero((wi * wo).sum(1) > 1.0 - 1e-6)
    flash = same[informative(codec, wi[same], wo[same], len(same))]
    for count in COUNTS:
        for seed in range(SEEDS):
            chosen = np.random.default_rng(1 + seed).choice(len(wi), count, replace=False)
            yield "random", count, chosen
        yield "far apart", count, apart[:count]
        yield "planned", count, planned[:count]
        if count <= len(flash):
            yield "flash", count, flash[:count]
            mixed = np.concatenate([flash[: count - count // 4], planned[: count // 4]])
            yield "flash, a quarter planned", count, mixed
    yield "all", len(wi), np.arange(len(wi))


def errors(codec: BasisCodec, texels: Texels, decode: TexelMap, chosen: Indices) -> list[float]:
    """Mean squared errors x 1e4 of all pairs, of each texture, coded from some pairs."""
    wi, wo = BONN.pairs()
    encode = on_all_cores(codec, codec.encoder(wi[chosen], wo[chosen]))
    return [
        1e4 * float(np.square(decode(encode(values[:, chosen])) - values).mean())
        for values in texels.values()
    ]


def srgb_bytes(values: Floats) -> npt.NDArray[np.uint8]:
    """Linear values as bytes of sRGB (IEC 61966-2-1), what is above 1 clipped."""
    clipped = np.clip(values, 0.0, 1.0)
    power = 1.055 * clipped ** (1.0 / 2.4) - 0.055
    encoded = np.where(clipped <= 0.0031308, 12.92 * clipped, power)
    return np.rint(255.0 * encoded).astype(np.uint8)


def photographed(texture: Btf, chosen: Indices, scale: float) -> Floats:
    """All texels at some pairs, by way of PNG images whose brightest value stands for `scale`."""
    wi, wo = (w[chosen] for w in BONN.pairs())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_plan(wi, wo, folder / "plan.csv")
        head, *lines = (folder / "plan.csv").read_text().splitlines()
        scaled = "".join(f"{line},{scale}\n" for line in lines)
        (folder / "directions.csv").write_text(f"{head},scale\n{scaled}")
        for line, picture in zip(lines, texture.images(chosen), strict=True):
            Image.fromarray(srgb_bytes(picture / scale)).save(folder / line.partition(",")[0])
        return load_photographs(folder).texels(slice(None))


def png_errors(
    codec: BasisCodec, textures: list[Btf], decode: TexelMap, chosen: Indices
) -> list[tuple[str, float, list[float]]]:
    """Of each texture: share of values above 1; errors from values, clipped, as PNG twice."""
    wi, wo = (w[chosen] for w in BONN.pairs())
    encode = on_all_cores(codec, codec.encoder(wi, wo))
    rows = []
    for texture in textures:
        texels = random_texels(texture, TEXELS, np.random.default_rng(0))
        truth = texture.texels(texels)
        values = truth[:, chosen]
        found = [
            1e4 * float(np.square(decode(encode(given)) - truth).mean())
            for given in (
                values,
                np.minimum(values, 1.0),
                photographed(texture, chosen, 1.0)[texels],
                photographed(texture, chosen, 4.0)[texels],
            )
        ]
        rows.append((texture.name, 100.0 * float((values > 1.0).mean()), found))
    return rows


def curve(means: dict[str, dict[int, float]]) -> Figure:
    """Errors against the number of photographs."""
    figure = Figure((6.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    whole = next(iter(means["all"].values()))
    for name, points in means.items():
        if name != "all":
            axes.plot(list(points), list(points.values()), marker="o", markersize=3.5, label=name)
    axes.axhline(whole, color="#707276", linewidth=0.8, linestyle="--", label="all 22,801 pairs")
    axes.set(xscale="log", yscale="log", xlabel="photographs", ylabel="MSE x 10⁴ at all pairs")
    axes.set_xticks(COUNTS, [f"{count:,}" for count in COUNTS])
    ticks = (20, 30, 40, 60, 80)
    axes.set_yticks(ticks, [str(tick) for tick in ticks])
    axes.minorticks_off()
    axes.legend(frameon=False, fontsize=8)
    return figure


def main() -> None:
    """Print Markdown tables and write the picture of the curves."""
    study = Study(__doc__, __file__)
    study.add_argument("captured", type=Path, help="folder with unseen/")
    options = study.options()
    codec = load_codec(PUBLISHED)
    assert isinstance(codec, BasisCodec)
    textures = [load_btf(path) for path in sorted((options.captured / "unseen").glob("*.npz"))]
    texels = {
        texture.name: texture.texels(random_texels(texture, TEXELS, np.random.default_rng(0)))
        for texture in textures
    }
    decode = on_all_cores(codec, codec.decoder(*BONN.pairs()))
    found: dict[tuple[str, int], list[list[float]]] = {}
    planned: dict[int, Indices] = {}
    for way, count, chosen in choices(codec):
        found.setdefault((way, count), []).append(errors(codec, texels, decode, chosen))
        if way == "planned":
            planned[count] = chosen
    rows, means = [], dict[str, dict[int, float]]()
    for (way, count), runs in found.items():
        by_texture = np.mean(runs, axis=0)
        means.setdefault(way, {})[count] = float(np.exp(np.log(by_texture).mean()))
        numbers = [f"{number:.1f}" for number in (*by_texture, means[way][count])]
        rows.append((f"{way}, {count:,}", *numbers))
    study.table(("MSE x 1e4", *texels, "geometric mean"), rows)
    write_plot(curve(means), study.output / "photographs.png")
    for count in PNG_COUNTS:
        outcome = png_errors(codec, textures, decode, planned[count])
        lines = [(name, f"{over:.2f} %", *(f"{e:.1f}" for e in mse)) for name, over, mse in outcome]
        study.table(
            ("MSE x 1e4", "values above 1", "values", "clipped", "PNG", "PNG, exposure 1/4"),
            lines,
            f"{count} planned photographs",
        )


if __name__ == "__main__":
    main()
