"""The web component `<nacre-view>`: one script that shows networks on other people's pages."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from nacre.mitsuba.environment import Environment
from nacre.neural.inputs import ENHANCED, PAPER, RECIPROCAL, input_count
from nacre.neural.nbrdf import HIDDEN, OUTPUTS, NeuralBrdf
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer
from nacre.sampling import GgxLobe, GgxMixture
from nacre.sampling.parametrizations import MixtureParametrization
from nacre.viewer.content import Content, own_environments
from nacre.viewer.page import packed, script


def component(environments: Sequence[Environment] | None = None) -> bytes:
    """The script, as UTF-8, that defines `<nacre-view src="x.safetensors">`.

    It shows any network; those with the usual shapes converge faster, because it has their
    samplers. Attributes are `src`, `shape`, `light` (the name of an environment, or "lamp"),
    `exposure` in stops, and `alt`. By default environments are the package's own; an empty list
    raises ValueError.
    """
    if environments is None:
        environments = own_environments()
    if not environments:
        raise ValueError("a component needs an environment")
    content = Content(environments, thumbnails=False, tabulate=False)
    for network in _usual_networks():
        content.allow(network)
    data = packed(content.facts, content.parts).decode()
    text = script("component", {"packed": f'export const PACKED = "{data}";\n'})
    return f"{{\n{text}\n}}\n".encode()


def _usual_networks() -> Iterator[NeuralBrdf]:
    """An empty network for each of the shapes that fits usually have."""
    cosines = MixtureParametrization.cosines
    some = (0.1,) * len(cosines)
    lobe = GgxLobe(some, some, some, some)
    for inputs, activation in ((ENHANCED, SQUARED_RELU), (PAPER, RELU), (RECIPROCAL, RELU)):
        for isotropic in (True, False):
            sizes = input_count(inputs, isotropic), *HIDDEN, OUTPUTS
            layers = [
                Layer(np.zeros((a, b), np.float32), np.zeros(b, np.float32))
                for a, b in itertools.pairwise(sizes)
            ]
            for lobes in (1, 2):
                angle = None if isotropic else 0.0
                yield NeuralBrdf(
                    layers,
                    isotropic=isotropic,
                    inputs=inputs,
                    activation=activation,
                    sampler=GgxMixture((lobe,) * lobes, some, some, cosines, angle),
                )
