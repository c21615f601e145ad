"""States of trainings and encodings that nacre 0.1.0 was stopped in: a later version goes on.

States are of one machine: some hold sums of the training data to the last bit, and refuse others.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre

pytest.importorskip("torch", reason="needs the extra 'btf'")

# What is reached for below the public names, all of it here.
from nacre import latent
from nacre.btf import encode, load, load_codec
from nacre.btf.basis import BasisRecipe, train_basis
from nacre.btf.basis.stages import Stages
from nacre.btf.networks import CustomSettings, TrainingRecipe, UnifiedSettings, train_network
from nacre.render.sphere import lit_pixels
from tests.test_written_files import (
    WRITTEN,
    Results,
    assert_same,
    expected,
    one_thread,
    same_machine,
)

LEARNED = tuple(WRITTEN / "states" / f"{name}.npz" for name in ("fabric01", "stone05", "wood03"))
"""Textures that models are trained on."""
MATERIALS = tuple(
    WRITTEN / "analytic" / f"{name}.json"
    for name in ("lambert", "ggx", "ward", "blinn-phong", "cook-torrance")
)
"""What bases are trained on."""
_NETWORKS = {"latent": 4, "hidden": (6,), "decoder_hidden": (7, 6)}
UNIFIED: dict[str, Any] = {"angular": (6, 5), "features": 8, **_NETWORKS}
CUSTOM: dict[str, Any] = {"channels": (3, 4), "kernel": 3, **_NETWORKS}
TRAINING = TrainingRecipe(batch=8)
BASIS = BasisRecipe(
    values=4, greys=6, chromas=2, texels=32, coded_texels=8, width=8, depth=2, wide=8,
    hidden=8, completing=8, function_steps=20, code_steps=20,
)  # fmt: skip
NEURAL = latent.BasisRecipe(values=5, hidden=(8, 7), steps=500, directions=512, batch=64)
HYPERNETWORK = latent.HypernetworkRecipe(width=6, steps=500, codes=16, directions=16)
AUTOENCODER = latent.AutoencoderRecipe(
    values=4, width=4, mixtures=3, steps=500, networks=4, pixels=32
)

Report = Callable[[str, int, int, str], None]


def materials() -> list[Callable[[], nacre.Brdf]]:
    """What opens the materials."""
    return [partial(nacre.load, path) for path in MATERIALS]


def neural(state: Path | None, report: Report | None = None) -> latent.NeuralBasis:
    """A neural basis."""
    return latent.train_neural(materials(), NEURAL, checkpoint=state, progress=report)


def hypernetwork(state: Path | None, report: Report | None = None) -> latent.Hypernetwork:
    """A hypernetwork of the basis in a file."""
    basis: Any = latent.find_basis(str(WRITTEN / "latent" / "basis-neural.safetensors"))
    return latent.train_hypernetwork(basis, HYPERNETWORK, checkpoint=state, progress=report)


def autoencoder(state: Path | None, report: Report | None = None) -> latent.Autoencoder:
    """An autoencoder."""
    pixels = lit_pixels(size=16)
    return latent.train_autoencoder(
        materials(), pixels, AUTOENCODER, checkpoint=state, progress=report
    )


def network(settings: Any, state: Path | None, report: Report | None = None) -> Any:
    """A network of textures."""
    return train_network(
        list(LEARNED), load, settings, TRAINING, steps=30, checkpoint=state, progress=report
    )


def basis_model(state: Path | None, report: Report | None = None) -> Any:
    """The default model, small."""
    told: Any = {} if report is None else {"progress": report}
    opened = [partial(load, path) for path in LEARNED]
    return train_basis(opened, BASIS, stages=state and Stages(state, "written"), **told)


def encoded(state: Path | None, report: Report | None = None) -> Any:
    """The capture, encoded three texels at a time."""
    told: Any = {} if report is None else {"progress": report}
    codec = load_codec(WRITTEN / "textures" / "model-basis.safetensors")
    capture = load(WRITTEN / "textures" / "capture.npz")
    return encode(capture, codec, texels_per_block=3, state=state, mark="written", **told)


MADE: dict[str, Callable[..., Any]] = {
    "neural": neural,
    "hypernetwork": hypernetwork,
    "autoencoder": autoencoder,
    "unified": lambda *rest: network(UnifiedSettings(**UNIFIED), *rest),
    "custom": lambda *rest: network(CustomSettings(**CUSTOM), *rest),
    "basis": basis_model,
    "encoding": encoded,
}
"""What goes on from a state of the name."""
READING = {"sampling", "networks"}
"""What trainings tell of before they come to their states."""


def outcome(name: str, state: Path | None, report: Report | None = None) -> Results:
    """Numbers that tell whether the outcome is the same."""
    with one_thread():
        made = MADE[name](state, report)
        if name == "encoding":
            return {"codes": made.codes, "mse": np.array(made.errors.mse)}
        if hasattr(made, "decoder"):
            capture = load(WRITTEN / "textures" / "capture.npz")
            codes = np.linspace(-1, 1, 2 * made.values, dtype=np.float32).reshape(2, -1)
            return {"decoded": made.decoder(capture.wi, capture.wo)(codes)}
        capture = load(WRITTEN / "textures" / "capture.npz")
        material = made.decode(np.linspace(-0.7, 0.6, len(made)))
        return {"f_r": material.eval(capture.wi, capture.wo)}


@pytest.mark.parametrize("name", MADE)
def test_states_are_gone_on_from(name, tmp_path):
    if not same_machine():
        pytest.skip("states are of the machine that wrote them")
    for path in (WRITTEN / "states").glob(f"{name}.state*"):
        shutil.copy(path, tmp_path)
    told: list[tuple[str, int]] = []
    found = outcome(
        name, tmp_path / f"{name}.state", lambda stage, done, *_: told.append((stage, done))
    )
    assert_same(found, expected("states")[name])
    if name == "encoding":
        assert told[0] == ("encoding", 9)
    else:
        assert {stage for stage, _ in told} <= READING
