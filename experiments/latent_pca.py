"""Principal components of published networks: how close codes of 32 values come to new materials.

Every network in a folder is a material, tabulated from the network, never measured. A seeded fifth
of them is held out; the others give the basis (:mod:`nacre.latent`). Each held-out material is
rendered from its network and from its code by the protocol of :mod:`nacre.render.sphere`, under an
environment map and under a directional light. Rows:

- permuted: a material counts with its six permutations of the channels; the code is projected;
- optimised: the same, the code then optimised on log(1 + 30 f cos theta_i);
- each channel by itself: the columns of Nielsen et al. 2015, so that 32 components take 3 x 32
  values of a colour material.

Run `python -m experiments.latent_pca [FOLDER] [--seed N]` from the root of the repository.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import nacre
from benchmarks.fidelity import figures
from benchmarks.table import markdown
from nacre.brdf import Brdf
from nacre.latent import Basis, PcaBrdf, optimised, train
from nacre.render.environment import load_environment
from tests.data import data_folder

SHARE = 0.2
"""Of the materials that is held out."""


def split(files: list[Path], seed: int) -> tuple[list[Path], list[Path]]:
    """Materials to train on, and held-out ones."""
    order = np.random.default_rng(seed).permutation(len(files))
    held = round(SHARE * len(files))
    return [files[i] for i in sorted(order[held:])], [files[i] for i in sorted(order[:held])]


def projected(basis: Basis, brdf: Brdf) -> PcaBrdf:
    """The nearest code in the logarithm."""
    return basis.decode(basis.project(brdf))


def refined(basis: Basis, brdf: Brdf) -> PcaBrdf:
    """The nearest code in what pictures show."""
    return basis.decode(optimised(basis, brdf))


def main() -> None:
    """Print one Markdown table."""
    data = data_folder()
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, help="networks; the published MERL ones")
    parser.add_argument("--seed", type=int, default=0, help="of the split")
    parser.add_argument("--values", type=int, default=32, help="of a code")
    options = parser.parse_args()
    if data is None:
        sys.exit("no real measurements: set NACRE_DATA to the folder that holds them")
    environment = load_environment(data / "environment" / "museum.exr")
    folder = options.folder or data / "pretrained" / "merl"
    training, held_out = split(sorted(folder.glob("*.h5")), options.seed)
    materials = [partial(nacre.load, path) for path in training]
    values = options.values

    methods: tuple[tuple[str, int, bool, Callable[[Basis, Brdf], PcaBrdf]], ...] = (
        (f"permuted, {values} values", values, False, projected),
        (f"the same, code optimised, {values} values", values, False, refined),
        (f"each channel by itself, 3 x {values} values", 3 * values, True, projected),
    )
    rows = []
    bases: dict[bool, Basis] = {}
    for name, size, separate, encode in methods:
        if separate not in bases:
            start = time.perf_counter()
            bases[separate] = train(materials, size, separate=separate)
            spent = time.perf_counter() - start
            note = (
                f"{len(training)} materials, {bases[separate].nbytes / 1e6:.1f} MB, {spent:.0f} s"
            )
            print(f"basis for {name}: {note}", file=sys.stderr, flush=True)
        found, seconds = [], []
        for path in held_out:
            truth = nacre.load(path)
            start = time.perf_counter()
            decoded = encode(bases[separate], truth)
            seconds.append(time.perf_counter() - start)
            found.append(figures(truth, decoded, environment))
            print(name, path.stem, *(f"{x:.4f}" for x in found[-1]), file=sys.stderr, flush=True)
        mean, spread = np.mean(found, axis=0), np.std(found, axis=0)
        worst = [*np.max(found, axis=0)[[0, 3]]]
        triples = (
            f"{m[0]:.4f} ± {s[0]:.4f} / {m[1]:.4f} / {m[2]:.1f}"
            for m, s in ((mean[:3], spread[:3]), (mean[3:], spread[3:]))
        )
        shown = f"{worst[0]:.4f}, {worst[1]:.4f}"
        rows.append((name, *triples, shown, f"{4 * size}", f"{np.median(seconds):.1f} s"))
    columns = "environment: MAE / SSIM / PSNR", "directional", "worst MAE", "code bytes", "encoding"
    print(markdown((f"{len(held_out)} held out, seed {options.seed}", *columns), rows))


if __name__ == "__main__":
    main()
