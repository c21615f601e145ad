"""Codes of a few values: how close those of new materials come, by model and number of values.

Every network in a folder is a material, tabulated from the network, never measured. A seeded fifth
of them is held out; the others give the bases (:mod:`nacre.latent`). Each held-out material is
rendered from its network and from its code by the protocol of :mod:`nacre.render.sphere`, under an
environment map and under a directional light, at 64 x 64 pixels and from 96 directions unless told
otherwise. Rows:

- PCA, optimized: principal components; a material counts with its six permutations of the channels;
  the code is optimized on log(1 + 30 f cos theta_i);
- neural: basis functions that a network gives, the code optimized likewise;
- with `--projected`: codes of principal components that are projected only, and those by channel,
  the columns of Nielsen et al. 2015, so that 32 components take 3 x 32 values of a color material.

With `--networks`, codes that stand for networks of 675 weights, in place of principal components:

- hypernetwork, from codes of the neural basis;
- autoencoder: the paper's; codes as the encoder gives them, and optimized.

`--between N` then takes N pairs of held-out materials and tells the albedo of what is half way
between their codes, beside the larger albedo of the two.

With `--samples N ...`, codes come from so many random samples of the material, uniform in the
Rusinkiewicz angles, in place of the whole: ridge regression on principal components, and the neural
basis with its own prior. All are nodes of the grid of the components, which costs them nothing.

Run `python -m studies.ablations.latent_codes [FOLDER] [--seed N] [--values N]` from the root of the
repository.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

import nacre
from nacre.brdf import Brdf
from nacre.latent import (
    Autoencoder,
    AutoencoderRecipe,
    BasisRecipe,
    Hypernetwork,
    HypernetworkRecipe,
    LatentBasis,
    NeuralBasis,
    PcaBasis,
    PcaRecipe,
)
from nacre.latent.pca import encoded
from nacre.measured.merl import node_directions
from nacre.metrics import albedo, compare
from nacre.numerics.direction_samples import DirectionSamples
from nacre.render.environment import Environment, load_environment
from nacre.reproduce.codes import split
from studies.speed.table import markdown
from tests.data import data_folder

RIDGE = 0.1
"""Weight of the squared code beside the sum of squared errors of the logarithm."""

Encode = Callable[[Brdf], Brdf]


def whole_codes(pca: PcaBasis, neural: NeuralBasis, values: int) -> dict[str, Encode]:
    """Codes of materials that are known everywhere."""
    return {
        f"PCA, optimized, {values} values": lambda brdf: pca.decode(pca.encode(brdf)),
        f"neural, {values} values": lambda brdf: neural.decode(neural.encode(brdf)),
    }


def network_bases(
    materials: list[Callable[[], Brdf]], neural: NeuralBasis, values: int, seed: int
) -> tuple[Hypernetwork, Autoencoder]:
    """Bases whose codes stand for networks."""
    start = time.perf_counter()
    hyper = Hypernetwork.train(materials, HypernetworkRecipe(seed=seed), base=neural)
    log(f"hypernetwork, loss {hyper.metadata['hypernetwork']['loss']:.4f}", hyper, start)
    start = time.perf_counter()
    recipe = AutoencoderRecipe(code_dim=values, seed=seed)
    auto = Autoencoder.train(materials, recipe)
    log(f"autoencoder, loss {auto.metadata['loss']:.6f}", auto, start)
    return hyper, auto


def network_codes(
    neural: NeuralBasis, hyper: Hypernetwork, auto: Autoencoder, values: int
) -> dict[str, Encode]:
    """Codes that stand for networks, and those of the neural basis."""
    return {
        f"neural, {values} values": lambda brdf: neural.decode(neural.encode(brdf)),
        f"hypernetwork, {values} values": lambda brdf: hyper.decode(hyper.encode(brdf)),
        f"autoencoder, encoder only, {values} values": lambda brdf: auto.decode(
            auto.encode(brdf, refine=False)
        ),
        f"autoencoder, optimized, {values} values": lambda brdf: auto.decode(auto.encode(brdf)),
    }


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


def log(name: str, basis: LatentBasis, start: float) -> None:
    """One line on a basis and the time that it took."""
    spent = time.perf_counter() - start
    print(f"{name}: {basis.nbytes:,} bytes, {spent:.0f} s", file=sys.stderr, flush=True)


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
    """Print one Markdown table."""
    data = data_folder()
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, help="networks; the published MERL ones")
    parser.add_argument("--seed", type=int, default=0, help="of the split and of the training")
    parser.add_argument("--values", type=int, default=32, help="of a code")
    parser.add_argument("--samples", type=int, nargs="*", default=[], help="known of a material")
    parser.add_argument("--ridge", type=float, default=RIDGE, help="of the regression")
    parser.add_argument("--networks", action="store_true", help="codes that stand for networks")
    parser.add_argument("--between", type=int, default=0, help="pairs of codes; with --networks")
    parser.add_argument("--projected", action="store_true", help="projected codes as well")
    parser.add_argument("--size", type=int, default=64, help="pixels of an edge")
    parser.add_argument("--directions", type=int, default=96, help="of light from the environment")
    options = parser.parse_args()
    if data is None:
        sys.exit("no real measurements: set NACRE_DATA to the folder that holds them")
    environment = load_environment(data / "environment" / "museum.exr")
    folder = options.folder or data / "pretrained" / "merl"
    training, held_out = split(list(folder.glob("*.h5")), options.seed)
    materials = [partial(nacre.load, path) for path in training]
    values = options.values

    start = time.perf_counter()
    neural = NeuralBasis.train(
        materials, BasisRecipe(code_dim=values, seed=options.seed, predictors=False)
    )
    log(f"neural, loss {neural.metadata['loss']:.4f}", neural, start)
    protocol = environment, options.size, options.directions
    if options.networks:
        hyper, auto = network_bases(materials, neural, values, options.seed)
        methods = network_codes(neural, hyper, auto, values)
        report(methods, held_out, options.seed, *protocol)
        if options.between:
            chosen = held_out, options.between, options.seed
            columns = "half way", "largest albedo", "above both ends", "at most, of the brighter"
            bases = {"neural": neural, "hypernetwork": hyper, "autoencoder": auto}
            print(markdown(columns, [(k, *between(b, *chosen)) for k, b in bases.items()]))
        return
    start = time.perf_counter()
    pca = PcaBasis.train(materials, PcaRecipe(values))
    log("PCA", pca, start)
    methods: dict[str, Encode] = {}
    for count in options.samples:
        methods |= sample_codes(pca, neural, count, options.ridge)
    methods = methods or whole_codes(pca, neural, values)
    if options.projected:
        methods[f"PCA, projected, {values} values"] = lambda brdf: pca.decode(
            pca.encode(brdf, refine=False)
        )
        by_channel = PcaBasis.train(materials, PcaRecipe(3 * values, separate=True))
        methods[f"PCA by channel, projected, 3 x {values} values"] = lambda brdf: by_channel.decode(
            by_channel.encode(brdf, refine=False)
        )
    report(methods, held_out, options.seed, *protocol)


def report(
    methods: dict[str, Encode],
    held_out: Sequence[Path],
    seed: int,
    environment: Environment,
    size: int,
    directions: int,
) -> None:
    """Print the table."""
    protocol = environment, size, directions
    rows = [row(name, encode, held_out, *protocol) for name, encode in methods.items()]
    columns = "environment: MAE / SSIM / PSNR", "directional", "worst MAE", "encoding, one core"
    print(markdown((f"{len(held_out)} held out, seed {seed}", *columns), rows))


def row(
    name: str,
    encode: Encode,
    held_out: Sequence[Path],
    environment: Environment,
    size: int,
    directions: int,
) -> tuple[str, ...]:
    """One line of the table: means over materials; the median time of a core that a code takes."""
    found, seconds = [], []
    for path in held_out:
        truth = nacre.load(path)
        start = time.process_time()
        decoded = encode(truth)
        seconds.append(time.process_time() - start)
        lights = compare(
            truth, decoded, environment=environment, size=size, directions=directions
        ).lights
        found.append([x for s in lights for x in (s.errors.mae, s.errors.ssim, s.errors.psnr)])
        print(name, path.stem, *(f"{x:.4f}" for x in found[-1]), file=sys.stderr, flush=True)
    mean, worst = np.mean(found, axis=0), np.max(found, axis=0)
    triples = (f"{m[0]:.4f} / {m[1]:.4f} / {m[2]:.1f}" for m in (mean[:3], mean[3:]))
    return name, *triples, f"{worst[0]:.4f}, {worst[3]:.4f}", f"{1e3 * np.median(seconds):.0f} ms"


if __name__ == "__main__":
    main()
