"""Processors of other vectors, and other numbers of threads: which numbers stay the same."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from tests.contracts.materials import made
from tests.contracts.processors import PROCESSORS, run
from tests.contracts.samplers import SAMPLERS
from tests.measured.support import relative_error
from tests.tiers import tiered

NAMES = (
    *("anisotropic network of enhanced inputs", "anisotropic physical network"),
    *("anisotropic RGL table", "sgd", "openpbr-anisotropic", "closures"),
)
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@pytest.fixture(scope="module", params=tiered(["few", "all"], ["few"]))
def source(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    few = request.param == "few"
    objects = {name: made(name) for name in (("sgd",) if few else NAMES)}
    samplers = ("two lobes", "tilted", "sharp microfacets", "sharpest Blinn-Phong")
    if few:
        samplers = samplers[:1]
    objects |= {name: made("ggx").replaced(sampler=SAMPLERS[name]()) for name in samplers}
    path = tmp_path_factory.mktemp("processors") / "objects.pickle"
    path.write_bytes(pickle.dumps(objects))
    return path


@pytest.mark.slow
def test_instructions_and_threads_change_no_bit_of_formulas(source: Path) -> None:
    """Of AVX-512 where there is it, AVX2 and SSE; other numbers change in their last digits."""
    here = [name for name, processor in PROCESSORS.items() if not processor.missing]
    assert "SSE" in here
    found = {}
    for name in here:
        target = source.with_name(f"{name}.npz")
        others = ONE_THREAD if name == here[0] else dict.fromkeys(ONE_THREAD, "2")
        run(name, source, target, ("compiled", "numpy"), others)
        found[name] = np.load(target)
    first = found[here[0]]
    for other in (found[name] for name in here[1:]):
        assert set(other) == set(first)
        for name in first:
            if name.startswith("compiled/"):
                assert other[name].tobytes() == first[name].tobytes(), name
            else:
                assert relative_error(other[name], first[name]).max() < 1e-6, name
