"""Predicted lobes beside searched ones: how much of the variance a prediction from a code leaves.

A neural basis and its predictors are trained, on MERL, Nielsen's and RGL networks without those of
the tables at hand; or, with `--merl`, on four fifths of the MERL networks. What is left over is
judged: the seven RGL tables, or the other MERL networks. Its code is found, lobes are predicted
from it, and the second moment of f cos(theta_i) / p under them is set beside that of lobes found
for the material itself, at directions that neither has seen. Kinds of lobes:

- cosine + Blinn-Phong, predicted by a network trained on the variance, and by one trained on labels
  as the NBRDF paper does it: fits of Ngan et al. 2005 to those of the training materials that have
  one. The fraction is that of the highlight in the albedo at normal incidence, kd and 4 ks n / (n +
  4) in the mean of the channels; the exponent is n;
- cosine + GGX;
- the two lobes of `fit_lobes`, predicted, and refined from the prediction by Newton steps.

Run `python -m studies.ablations.predicted_lobes [--merl]`. The
basis is kept with the results and trained only if it is not there yet.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import torch

import nacre
from nacre.analytic.tables import load as load_fit
from nacre.analytic.tables import materials as fitted_names
from nacre.array import Floats
from nacre.brdf import Brdf, Sampler
from nacre.geometry import split
from nacre.io.files import digest
from nacre.latent import (
    BasisRecipe,
    LobePredictor,
    NeuralBasis,
    PredictorRecipe,
)
from nacre.latent.file import load_basis, save_basis
from nacre.neural import Layer
from nacre.numerics.channels import PERMUTATIONS
from nacre.numerics.newton import minimize
from nacre.reproduce.cache import Cache, cache_key, code_digest
from nacre.reproduce.codes import split as split_files
from nacre.runtime.parallel import one_blas_thread
from nacre.sampling import fit_blinn_phong, fit_lobes
from nacre.sampling.lobes import MAX_EXPONENT
from nacre.sampling.mixture_moment import MixtureMoment
from nacre.sampling.moment import Moment, second_moment
from nacre.sampling.parametrizations import MixtureParametrization
from studies.ablations.sampling import fit_plain_ggx
from studies.study import Study, data, log, rgl_tables

Fit = Callable[[Brdf, Floats], Sampler]
"""From a material and its code to its lobes."""

ENCODING = "(the code itself)"
SEEN = 1234
"""Seed of the directions that judge."""
JITTER = 0.2
"""Standard deviation that is added to codes with labels."""


def materials(seed: int | None) -> tuple[list[Path], list[Path]]:
    """Files to train on, and files to judge."""
    networks = {
        name: sorted(data("pretrained", name).glob("*.h5")) for name in ("merl", "nielsen", "rgl")
    }
    if seed is not None:
        return split_files(networks["merl"], seed)
    tables = rgl_tables("*_rgb.bsdf")
    known = {table.stem for table in tables}
    every = [path for paths in networks.values() for path in paths]
    return [path for path in every if path.stem not in known], tables


def trained(files: Sequence[Path], cache: Cache, quick: bool) -> NeuralBasis:
    """A basis of materials with its predictors."""
    recipe = BasisRecipe(steps=200) if quick else BasisRecipe()

    def make(state: Path) -> NeuralBasis:
        return NeuralBasis.train([partial(nacre.load, path) for path in files], recipe)

    facts = [[digest(path) for path in files], quick, code_digest()]
    basis = cache.file(cache_key("predicted", facts), load_basis, make, save_basis)
    assert isinstance(basis, NeuralBasis)
    return basis


def labeled(basis: NeuralBasis, files: Sequence[Path], labels: Path) -> LobePredictor:
    """Blinn-Phong lobes by labels: squared errors of the fraction and of ln(exponent)."""
    known = fitted_names(labels)
    given = [path for path in files if path.stem in known]
    codes = np.array([basis.encode(nacre.load(path)) for path in given])
    found = []
    for path in given:
        fit = load_fit(labels, path.stem).values
        kd, ks, n = (float(np.mean(fit[name])) for name in ("diffuse", "specular", "exponent"))
        highlight = 4.0 * ks * n / (n + 4.0)
        found.append((highlight / (highlight + kd), np.log(n) / np.log(MAX_EXPONENT)))
    log(f"{len(given)} labels")
    targets = torch.tensor(np.clip(found, 0.0, 1.0), dtype=torch.float32)
    recipe, random = PredictorRecipe(), np.random.default_rng(7)
    torch.manual_seed(7)
    network = torch.nn.Sequential(
        torch.nn.Linear(basis.code_dim, recipe.hidden),
        torch.nn.Tanh(),
        torch.nn.Linear(recipe.hidden, 2),
    )
    adam = torch.optim.Adam(network.parameters(), 1e-3, weight_decay=1e-5)
    for _ in range(recipe.steps):
        index = random.integers(len(codes), size=recipe.batch)
        drawn = basis.permuted(codes[index], random.integers(len(PERMUTATIONS), size=recipe.batch))
        drawn += JITTER * random.normal(size=drawn.shape)
        loss = (
            (torch.sigmoid(network(torch.from_numpy(drawn).float())) - targets[index])
            .square()
            .mean()
        )
        adam.zero_grad()
        loss.backward()
        adam.step()
    layers = [
        Layer(layer.weight.detach().numpy().T, layer.bias.detach().numpy())
        for layer in (network[0], network[2])
    ]
    return LobePredictor("blinn-phong", layers)


def judged(
    files: Sequence[Path], fits: dict[str, Fit], basis: NeuralBasis
) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Second moments, and milliseconds of a core that finding the lobes takes, by kind."""
    moments: dict[str, list[float]] = {name: [] for name in fits}
    times: dict[str, list[float]] = {name: [] for name in (*fits, ENCODING)}
    for path in files:
        brdf = nacre.load(path)
        seen = second_moment(brdf, SEEN)
        basis.encode(brdf)  # what is evaluated once only is not timed
        start = time.process_time()
        code = basis.encode(brdf)
        times[ENCODING].append(1e3 * (time.process_time() - start))
        for name, fit in fits.items():
            start = time.process_time()
            found = fit(brdf, code)
            times[name].append(1e3 * (time.process_time() - start))
            moments[name].append(value(found, seen))
        log(path.stem, *(f"{of[-1]:.3f}" for of in moments.values()))
    return moments, times


def value(sampler: Sampler, moment: Moment) -> float:
    """Second moment under the density of a sampler."""
    density = sampler.pdf_components(split(moment.wi), split(moment.wo))
    return float((moment.weights / density).sum())


def refined(predict: LobePredictor, code: Floats, brdf: Brdf, steps: int) -> Sampler:
    """Newton steps from predicted lobes."""
    function = MixtureMoment(
        second_moment(brdf), MixtureParametrization.cosines, MixtureParametrization.lobes, None
    )
    return function.mixture(minimize(function, predict.free(code), steps)[1])


def main() -> None:
    """Train what is not there, judge, print a table."""
    study = Study(__doc__, __file__)
    study.add_argument("--merl", action="store_true", help="hold out a fifth of the MERL networks")
    options = study.options()
    given, left = materials(options.seed if options.merl else None)
    torch.set_num_threads(1)
    basis = trained(study.few(given, 8), study.cache, options.quick)
    merl = [path for path in given if path.parent.name == "merl"]
    by_labels = labeled(basis, merl, data("merl-fits", "ngan_blinnphong.fit"))
    phong, ggx, mixture = (basis.predictors[name] for name in ("blinn-phong", "ggx", "mixture"))
    fits: dict[str, Fit] = {
        "Blinn-Phong, searched": lambda brdf, code: fit_blinn_phong(brdf),
        "Blinn-Phong, predicted": lambda brdf, code: phong(code),
        "Blinn-Phong, predicted by labels": lambda brdf, code: by_labels(code),
        "GGX, searched": lambda brdf, code: fit_plain_ggx(brdf),
        "GGX, predicted": lambda brdf, code: ggx(code),
        "`fit_lobes`": lambda brdf, code: fit_lobes(brdf),
        "its lobes, predicted": lambda brdf, code: mixture(code),
        **{
            f"predicted, {steps} steps": lambda brdf, code, steps=steps: refined(
                mixture, code, brdf, steps
            )
            for steps in (5, 10, 50)
        },
    }
    with one_blas_thread():
        moments, times = judged(left, fits, basis)
    rows, best = [], np.array([])
    for name, found in moments.items():
        if "predicted" not in name:
            best = np.array(found)
        ratio = np.array(found) / best
        figures = (np.median(found), np.max(found), np.median(ratio), np.max(ratio))
        rows.append((name, *(f"{x:.3f}" for x in figures), f"{np.median(times[name]):.2f}"))
    rows.append((ENCODING, "", "", "", "", f"{np.median(times[ENCODING]):.2f}"))
    columns = "second moment: median", "worst", "of the searched: median", "worst", "ms"
    study.table((f"{len(left)} materials", *columns), rows)


if __name__ == "__main__":
    main()
