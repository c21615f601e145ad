"""Effects of training and of decoder sizes on the papers' networks."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.textures.codecs.codec import TexelCodec
from nacre_lab.reproduce.chart import charts, color_of, dress, place_labels
from nacre_lab.reproduce.experiment import Outcome
from nacre_lab.reproduce.tables import geometric_mean, markdown_table, scaled
from nacre_lab.reproduce.textures.methods import KINDS, Method
from nacre_lab.reproduce.textures.study import Study
from nacre_lab.reproduce.textures.trainings import Training, training_curves

_TEXELS, _DIRECTIONS = 64, 1024
"""Number of values decoded for timing."""
_ROUNDS = 9


class _Size(NamedTuple):
    """A decoder, the error on unseen materials, and seconds per decoded value of three channels."""

    method: str
    layers: int
    width: int
    products: int
    mse: float
    seconds: float


def training(study: Study, methods: Sequence[Method]) -> Outcome:
    """Losses on held-out texels against steps and time.

    Raises
    ------
    NacreError
        If a codec cannot be made, or no method is a network with held-out texels.
    """
    found = [each for each in study.trainings(methods) if _validated(each)]
    if not found:
        raise NacreError("no method here is a network that is validated during training")
    rows = [
        (each.name, row.step, row.seconds, row.learning_rate, row.loss, row.validation)
        for each in found
        for row in each.rows
        if row.validation is not None
    ]
    lines = [
        [
            each.name,
            *(f"{_lowest(each, part):.4f}" for part in (0.1, 0.25, 0.5, 1.0)),
            "–" if each.seconds is None else f"{1e3 * each.seconds / each.steps:.0f}",
        ]
        for each in found
    ]
    head = ["held-out loss after", "a tenth", "a quarter", "a half", "all of it", "ms a step"]
    columns = ("method", "step", "seconds", "learning rate", "loss", "held-out loss")
    return Outcome({"": training_curves(found)}, columns, rows, markdown_table(head, lines))


def decoder(study: Study, methods: Sequence[Method]) -> Outcome:
    """Errors on unseen materials and decoding times, by size of the decoder.

    Raises
    ------
    NacreError
        If a codec cannot be made, or a method is not a network.
    """
    rows: list[_Size] = []
    for method in methods:
        if KINDS[method.kind].network is None:
            raise NacreError(f"{method.name}: is not a network; name some like unified-32:2x106")
        found = [study.errors(method, material) for material in study.unseen]
        errors = [each.mse for each in found if each is not None]
        if len(errors) < len(found):
            continue
        codec = study.codec(method, study.unseen[0])
        hidden = list(codec.describe()["decoder hidden"])
        sizes = [codec.code_dim + 4, *hidden, 3]
        products = sum(a * b for a, b in itertools.pairwise(sizes))
        seconds = study.timed(method, study.unseen[0], decoding_seconds)
        mse = geometric_mean(errors)
        rows.append(_Size(method.name, len(hidden), hidden[0], products, mse, seconds))
    columns = ("method", "hidden layers", "width", "products", "mse", "seconds a value")
    lines = [
        [
            *(row.method, str(row.layers), str(row.width), f"{row.products:,}"),
            *(scaled(row.mse), f"{1e9 * row.seconds:.0f}"),
        ]
        for row in rows
    ]
    head = ["network", "hidden layers", "width", "products a value", "MSE x 10⁴", "ns a value"]
    if not rows:
        return Outcome({}, columns, rows, markdown_table(head, lines))
    figure, (axes,) = charts(1, 5.6, 4.0)
    points = np.array([(1e9 * row.seconds, 1e4 * row.mse) for row in rows])
    for index, depth in enumerate(sorted({row.layers for row in rows})):
        own = points[[row.layers == depth for row in rows]]
        own = own[np.argsort(own[:, 0])]
        label = f"{depth} hidden layer{'s' if depth > 1 else ''}"
        axes.plot(*own.T, "o-", color=color_of(index), label=label, linewidth=1.2, markersize=4)
    dress(
        axes, x="nanoseconds to decode a value, one core", y="geometric mean of MSE x 10⁴", log="xy"
    )
    place_labels(axes, points, [f"{row.layers}x{row.width}" for row in rows])
    axes.legend(fontsize=8, frameon=False)
    return Outcome({"": figure}, columns, rows, markdown_table(head, lines))


def decoding_seconds(codec: TexelCodec, wi: Floats, wo: Floats) -> float:
    """Median seconds to decode a value of three channels."""
    every = np.linspace(0, len(wi) - 1, min(_DIRECTIONS, len(wi))).astype(int)
    decode = codec.decoder(wi[every], wo[every])
    codes = np.zeros((_TEXELS, codec.code_dim), np.float32)
    taken = []
    for _ in range(_ROUNDS):
        before = time.perf_counter()
        decode(codes)
        taken.append(time.perf_counter() - before)
    return float(np.median(taken)) / (len(codes) * len(every))


def _validated(each: Training) -> bool:
    return any(row.validation is not None for row in each.rows)


def _lowest(each: Training, part: float) -> float:
    """The last held-out loss within a fraction of the training."""
    losses = [(row.step, row.validation) for row in each.rows if row.validation is not None]
    within = [loss for step, loss in losses if step <= part * each.steps] or [losses[0][1]]
    return float(within[-1])
