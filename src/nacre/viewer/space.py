"""A map of a page's materials, and the data to decode the places between them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.figures.texel_map import apart
from nacre.io.tensors import to_bytes
from nacre.latent.file import pretrained_hypernetwork
from nacre.latent.hypernetwork import Hypernetwork
from nacre.latent.map import MIN_CODES, embed
from nacre.latent.weights import SIZES, named_tensors
from nacre.neural.chain_file import numbered_tensors
from nacre.neural.nbrdf import NeuralBrdf
from nacre.runtime.progress import Progress, silent
from nacre.sampling.parametrizations import BEST, MixtureParametrization
from nacre.viewer.content import Content, Entry

_LIMIT = 1 << 26  # bytes, which the page reads back
_LARGEST, _CROWDED = 0.12, 0.6  # edge of a place, at most, and times the root of their count


def add_space(content: Content, entries: Sequence[Entry], *, progress: Progress = silent) -> int:
    """Lay out a page's materials by appearance, with all codes between them; about 0.6 MB.

    Codes belong to the included hypernetwork (:func:`nacre.latent.pretrained_hypernetwork`), and
    places are their t-SNE. The first form of each entry is encoded; materials without a code, such
    as anisotropic ones, are left out. `content` already holds the entries, in this order, as its
    first materials.

    Returns how many materials are on the map: 0 if fewer than :data:`nacre.latent.map.MIN_CODES`
    have a code; the page then gets no map. Raises MissingExtraError if openTSNE is not installed.
    """
    basis = pretrained_hypernetwork()
    on_map, codes = [], []
    for index, entry in enumerate(entries):
        with suppress(NacreError):  # this material has no code
            codes.append(basis.encode(next(iter(entry.forms.values())), seed=0))
            on_map.append(index)
        progress("encoding", index + 1, len(entries), entry.name)
    if len(codes) < MIN_CODES:
        return 0
    values = np.array(codes, np.float32)
    content.allow(decoded(basis, values[0]))
    part = content.part("space", _packed(basis, values, places(values)))
    edge = _edge(len(codes))
    content.facts["space"] = {"part": part, "materials": on_map, "edge": edge}
    return len(codes)


def decoded(basis: Hypernetwork, code: npt.ArrayLike, name: str = "") -> NeuralBrdf:
    """The network for a code (k,), with the sampler predicted from the code."""
    network = basis.decode(code, name)
    return NeuralBrdf(network.layers, name=name, sampler=basis.basis.predictors[BEST](network.code))


def places(codes: npt.ArrayLike) -> Floats:
    """Places of codes (n, k) on a map with edge 1, x right and y down, shape (n, 2).

    They fill the map without overlaps.
    """
    found = embed(codes, 0)
    low, high = found.min(axis=0), found.max(axis=0)
    edge = _edge(len(found))
    even = edge + (1.0 - 2.0 * edge) * (found - low) / np.maximum(high - low, 1e-9)
    bounds = np.array([[0.3 * edge] * 2, [1.0 - 0.3 * edge] * 2])
    return apart(even, np.full((len(found), 2), edge), bounds)


def _edge(count: int) -> float:
    return float(min(_LARGEST, _CROWDED / np.sqrt(count)))


def _packed(basis: Hypernetwork, codes: Floats, where: Floats) -> bytes:
    """Codes, their places, and layers that decode codes, as a file for the page."""
    predictor = basis.basis.predictors[BEST]
    header = {
        "luma": basis.basis.luma,
        "sizes": list(SIZES),
        "basis": basis.fingerprint(),
        "cosines": list(MixtureParametrization.cosines),
        "lobes": MixtureParametrization.lobes,
    }
    tensors = named_tensors(basis.layers) | numbered_tensors(predictor.layers, "predictor_")
    tensors |= {"codes": codes, "places": np.asarray(where, np.float32)}
    return to_bytes("nacre", header, tensors, _LIMIT)
