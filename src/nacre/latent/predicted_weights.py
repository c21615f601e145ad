"""Predictors of lobes for codes of an autoencoder: the end of the NBRDF paper's pipeline.

NBRDF paper, section 3.3 and Figure 4: the encoder's code of a network goes into a shallow network
that gives parameters of a Blinn-Phong or GGX lobe.
"""

from __future__ import annotations

import numpy as np

from nacre.analytic import labels
from nacre.array import Floats
from nacre.brdf import Sampler
from nacre.latent.autoencoder import Autoencoder
from nacre.latent.predictor_training import with_labels, with_predictors
from nacre.latent.recipes import AutoencoderRecipe, PredictorRecipe
from nacre.latent.weights import COUNT, network_layers
from nacre.neural.nbrdf import NeuralBrdf
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress


def predicting(
    autoencoder: Autoencoder, orders: Floats, recipe: AutoencoderRecipe, report: Progress
) -> Autoencoder:
    """An autoencoder that knows codes of its training materials, and predicts lobes from codes.

    Predictors are trained in two ways, by variance and by labels (see
    :mod:`nacre.latent.predictor_training`), unless the recipe says that there are none.

    Parameters
    ----------
    autoencoder
        Without predictors.
    orders
        Networks of the training materials as the encoder takes them, with their channels in all
        orders, the material's own first, shape (m, 6, 675). Labels are fitted to these.
    recipe
        That of the autoencoder.
    report
        Called as it goes on.
    """
    codes = autoencoder.codes(orders.reshape(-1, COUNT)).reshape(*orders.shape[:2], -1)
    known = autoencoder.replaced(examples=codes.astype(np.float32))
    if not recipe.predictors:
        return known
    settings = PredictorRecipe(steps=min(recipe.steps, PredictorRecipe.steps), seed=recipe.seed)
    found = with_predictors(known, settings, report)
    return with_labels(found, _labels(orders[:, 0], recipe.seed, report), settings, report)


def _labels(networks: Floats, seed: int, report: Progress) -> dict[str, list[Sampler]]:
    """Lobes of models fitted to networks (m, 675), by family."""
    found: dict[str, list[Sampler]] = {family: [] for family in labels.MODELS}
    total = len(found) * len(networks)

    def fitted(pair: tuple[str, Floats]) -> Sampler:
        family, weights = pair
        return labels.fitted_lobes(NeuralBrdf(network_layers(weights)), family, seed)

    pairs = [(family, weights) for family in found for weights in networks]
    for done, ((family, _), lobes) in enumerate(
        zip(pairs, thread_map(fitted, pairs), strict=True), 1
    ):
        found[family].append(lobes)
        report("models", done, total, family)
    return found
