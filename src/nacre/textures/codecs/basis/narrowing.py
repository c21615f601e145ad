"""Codecs of fewer values for a few textures, made of one for all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nacre.array import Floats
from nacre.numerics.mlp import Layer
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.networks import SkipNetwork


def narrowed(codec: BasisCodec, codes: Floats, code_dim: int) -> BasisCodec:
    """The codec with codes of fewer values, for textures like those that some codes are of.

    New codes are places along axes in the space of the old ones, about their mean, so that the
    first layers of the networks can be multiplied with the axes and nothing else changes. The axes
    are those of a regression of reduced rank (Izenman 1975) of coefficients by codes: they keep
    what matters to reflectance. All have the same variance.

    Parameters
    ----------
    codec
        For all textures.
    codes
        Of it, at least `code_dim` different ones, shape (n, codec.code_dim).
    code_dim
        Number of values of the new codes.

    Raises
    ------
    ValueError
        If that is not from 1 to what the codec has, or codes differ in fewer ways.
    """
    if not 1 <= code_dim <= codec.code_dim:
        raise ValueError(f"codes of {code_dim} values of those of {codec.code_dim}")
    old = codes.astype(np.float64)
    center = old.mean(axis=0)
    old -= center
    coefficients = codec.decode(np.asarray(codes, np.float32)).astype(np.float64)
    coefficients -= coefficients.mean(axis=0)
    slopes = np.linalg.lstsq(old, coefficients, rcond=None)[0]
    gram = old.T @ old / len(old)
    values, vectors = np.linalg.eigh(slopes.T @ gram @ slopes)
    chosen = np.argsort(-values)[:code_dim]
    if values[chosen[-1]] <= 1e-12 * values[chosen[0]]:
        raise ValueError(f"the codes differ in fewer than {code_dim} ways")
    onto = slopes @ vectors[:, chosen] / np.sqrt(values[chosen])  # from old codes to new ones
    axes = onto.T @ gram  # back, by regression: new codes have variance 1 and no correlation
    return replace(
        codec,
        encode=_onto(codec.encode, center, onto),
        decode=_from(codec.decode, center, axes),
        metadata=codec.metadata | {"narrowed from": codec.code_dim},
    )


def _onto(network: SkipNetwork, center: Floats, onto: Floats) -> SkipNetwork:
    """What gives (x - center) @ onto of the outputs x of a network."""
    *layers, last = network.layers
    turned = Layer(_single(last.weights @ onto), _single((last.biases - center) @ onto))
    return SkipNetwork(_single(network.linear @ onto), [*layers, turned])


def _from(network: SkipNetwork, center: Floats, axes: Floats) -> SkipNetwork:
    """What takes x as a network takes center + x @ axes."""
    first, *layers, last = network.layers
    turned = Layer(_single(axes @ first.weights), _single(first.biases + center @ first.weights))
    moved = Layer(last.weights, _single(last.biases + center @ network.linear))
    return SkipNetwork(_single(axes @ network.linear), [turned, *layers, moved])


def _single(values: Floats) -> Floats:
    """Of numbers that files hold in half precision."""
    return np.asarray(np.asarray(values, np.float16), np.float32)
