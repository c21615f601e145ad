"""Codes from few samples, codes by channel, and what lies half way between two codes.

`nacre reproduce table2 NETWORKS` compares codes of whole materials; this study takes its bases, and
keeps them as it does. Every network in a folder is a material, tabulated from the network, never
measured. A seeded fifth of them is held out; the others give the bases (:mod:`nacre.latent`). Each
held-out material is rendered from its network and from its code by the protocol of
:mod:`nacre.mitsuba.sphere`, under an environment map and under a directional light, at 64 x 64
pixels and from 96 directions unless told otherwise.

- `--samples N ...`: codes come from so many random samples of the material, uniform in the
  Rusinkiewicz angles, in place of the whole: ridge regression on principal components, and the
  neural basis with its own prior. All are nodes of the grid of the components, which costs them
  nothing.
- `--by-channel`: codes of principal components of one channel, projected, the columns of Nielsen et
  al. 2015, so that 32 components take 3 x 32 values of a color material; beside those of colors.
- `--between N`: N pairs of held-out materials, and the albedo of what is half way between their
  codes, beside the larger albedo of the two.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

import nacre
from lab.studies.study import (
    PICTURE_ERRORS,
    Study,
    data,
    log,
    museum,
    picture_errors,
    progress,
    triples,
)
from nacre.brdf import Brdf
from nacre.latent import LatentBasis, NeuralBasis, PcaBasis, PcaRecipe
from nacre.latent.pca import encoded
from nacre.measured.merl import node_directions
from nacre.metrics import albedo
from nacre.numerics.direction_samples import DirectionSamples
from nacre_lab.reproduce.codes import CodeSettings, bases, split

RIDGE = 0.1
"""Weight of the squared code beside the sum of squared errors of the logarithm."""

Encode = Callable[[Brdf], Brdf]


def between(basis: LatentBasis, held_out: Sequence[Path], pairs: int, seed: int) -> tuple[str, ...]:
    """One line on materials half way between two codes: albedo for light along the normal."""
    codes = [basis.encode(nacre.load(path)) for path in held_out]
    random = np.random.default_rng((seed, 6))
    found, ratios = [], []
    for _ in range(pairs):
        one, other = (codes[k] for k in random.permutation(len(codes))[:2])
        middle, *ends = (
            albedo(basis.decode(code), [0.0]).value[0] for code in (0.5 * (one + other), one, other)
        )
        found.append(middle.max())
        ratios.append((middle / np.max(ends, axis=0)).max())
    above = sum(ratio > 1.0 for ratio in ratios)
    return f"{max(found):.3f}", f"{above} of {pairs}", f"{max(ratios):.2f}"


def sample_codes(pca: PcaBasis, neural: NeuralBasis, count: int, ridge: float) -> dict[str, Encode]:
    """Codes from a few samples, at nodes of the grid so that no interpolation enters."""
    nodes = np.flatnonzero(pca.mask.reshape(-1))
    theta_h = np.unravel_index(nodes, pca.mask.shape)[0]
    drawn = np.random.default_rng(count).choice(
        len(nodes), count, replace=False, p=(theta_h + 0.5) / (theta_h + 0.5).sum()
    )
    wi, wo = (
        np.stack(np.broadcast_arrays(*w, 0.0 * pca.mask)[:3], axis=-1).reshape(-1, 3)[nodes[drawn]]
        for w in node_directions(pca.resolution)
    )
    weights = pca.weights()[drawn]
    parts = pca.components[pca.uses][:, drawn].T.astype(np.float64) * pca.deviations
    rows = (parts[:, None, :] * pca.colors.T).reshape(-1, pca.code_dim)
    normal = rows.T @ rows + ridge * np.eye(pca.code_dim)

    def by_ridge(brdf: Brdf) -> Brdf:
        logs = encoded(brdf.eval(wi, wo), weights) - pca.center[drawn, None]
        return pca.decode(np.linalg.solve(normal, rows.T @ logs.reshape(-1)))

    def by_network(brdf: Brdf) -> Brdf:
        return neural.decode(neural.encode(DirectionSamples(wi, wo, brdf.eval(wi, wo))))

    return {
        f"PCA by ridge regression, {count} samples": by_ridge,
        f"neural, {count} samples": by_network,
    }


def main() -> None:
    """Print the tables asked for."""
    study = Study(__doc__, __file__)
    study.add_argument("folder", nargs="?", type=Path, help="networks; the published MERL ones")
    study.add_argument("--code-dim", type=int, default=32, help="values of a code")
    study.add_argument("--samples", type=int, nargs="*", default=[], help="known of a material")
    study.add_argument("--ridge", type=float, default=RIDGE, help="weight of the regression's")
    study.add_argument("--by-channel", action="store_true", help="components of one channel")
    study.add_argument("--between", type=int, default=0, help="pairs of codes")
    study.add_argument("--size", type=int, default=64, help="pixels of an edge")
    study.add_argument("--directions", type=int, default=96, help="of light from the environment")
    options = study.options()
    folder = options.folder or data("pretrained", "merl")
    files = study.few(sorted(folder.glob("*.h5")), 20)
    settings = CodeSettings(seed=options.seed, code_dim=options.code_dim)
    if options.quick:
        settings = CodeSettings(
            seed=options.seed, code_dim=options.code_dim, steps=500, mixtures=60
        )
    training, held_out = split(files, options.seed)
    kinds = ["pca", "neural", *(("hypernetwork", "autoencoder") if options.between else ())]
    found = bases(training, kinds, settings, study.cache, progress)
    pca, neural = found["pca"], found["neural"]
    assert isinstance(pca, PcaBasis)
    assert isinstance(neural, NeuralBasis)
    methods: dict[str, Encode] = {}
    for count in options.samples:
        methods |= sample_codes(pca, neural, count, options.ridge)
    if options.by_channel:
        materials = [partial(nacre.load, path) for path in training]
        by_channel = PcaBasis.train(materials, PcaRecipe(3 * options.code_dim, separate=True))
        for name, basis in (("PCA", pca), ("PCA by channel", by_channel)):
            methods[f"{name}, projected"] = lambda brdf, b=basis: b.decode(
                b.encode(brdf, refine=False)
            )
    if methods:
        protocol = {"size": options.size, "directions": options.directions}
        rows = [row(name, code, held_out, **protocol) for name, code in methods.items()]
        columns = *PICTURE_ERRORS, "worst MAE", "encoding, one core"
        study.table((f"{len(held_out)} held out, seed {options.seed}", *columns), rows)
    if options.between:
        columns = "half way", "largest albedo", "above both ends", "at most, of the brighter"
        chosen = held_out, options.between, options.seed
        rows = [(kind, *between(basis, *chosen)) for kind, basis in found.items()]
        study.table(columns, rows, "between")


def row(name: str, code: Encode, held_out: Sequence[Path], **protocol: int) -> tuple[str, ...]:
    """One line of the table: means over materials; the median time of a core that a code takes."""
    found, seconds = [], []
    for path in held_out:
        truth = nacre.load(path)
        start = time.process_time()
        decoded = code(truth)
        seconds.append(time.process_time() - start)
        found.append(picture_errors(truth, decoded, museum(), **protocol))
        log(name, path.stem, *(f"{x:.4f}" for x in found[-1]))
    mean, worst = np.mean(found, axis=0), np.max(found, axis=0)
    spent = f"{1e3 * np.median(seconds):.0f} ms"
    return name, *triples(mean), f"{worst[0]:.4f}, {worst[3]:.4f}", spent


if __name__ == "__main__":
    main()
