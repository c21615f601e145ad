"""Methods and measures: every representation has a row, and figures are those of closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS
from nacre.array import Components, namespace
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import formats
from nacre.latent import BASES, LatentBasis, find_basis
from nacre.neural.recipe import PRESETS
from nacre.runtime.progress import silent
from nacre_lab.benchmark import Method
from nacre_lab.benchmark import methods as module
from nacre_lab.benchmark.methods import Bases, find_methods, methods
from nacre_lab.benchmark.protocol import MEASURES, PROTOCOLS, measure
from nacre_lab.benchmark.splits import Split, find_split
from nacre_lab.reproduce.codes import CODES, CodeSettings
from nacre_lab.reproduce.trial import Reference
from tests.latent.made import random_basis

KNOWN = methods(PROTOCOLS["quick"])
GRAY = MODELS["lambert"](diffuse=(0.5, 0.5, 0.5), name="gray")
SAME = {".npz", ".csv", ".exr"}
"""Endings of tables that hold what another one does."""


def test_every_representation_has_a_method() -> None:
    assert set(MODELS) <= set(KNOWN)
    assert set(CODES) <= set(KNOWN)
    assert {code.kind for code in CODES.values()} == set(BASES)
    for preset in PRESETS:
        assert ("enhanced-675" + ("" if preset == "standard" else f"-{preset}")) in KNOWN
    tables = {
        f"file{entry.extensions[0]}"
        for entry in formats("brdf")
        if entry.save and entry.measured and entry.extensions[0] not in SAME
    }
    assert tables <= set(KNOWN)


@pytest.mark.parametrize("ending", [".bsdf", ".zemax.bsdf", ".bin"])
def test_files_are_written_and_read(ending: str) -> None:
    found = KNOWN[f"file{ending}"].fit(GRAY)
    w = np.array([[0.6, 0.0, 0.8], [0.0, 0.28, 0.96]])
    np.testing.assert_allclose(found.eval(w, w[::-1]), 0.5 / np.pi, rtol=1e-3)
    assert found.nbytes is not None
    assert found.nbytes > 10_000


def test_methods_are_found_by_name_and_slow_ones_on_request() -> None:
    assert "texture-network-2019" not in find_methods((), KNOWN)
    assert list(find_methods(("texture-network-2019", "ggx"), KNOWN)) == [
        "texture-network-2019",
        "ggx",
    ]
    with pytest.raises(NacreError, match=r"'magic' is not a method \(known: truth, "):
        find_methods(("magic",), KNOWN)


def test_figures_of_a_gray_are_those_of_closed_forms() -> None:
    pytest.importorskip("skimage", reason="needs the extra 'render'")
    reference = Reference("gray", GRAY, PROTOCOLS["quick"])
    darker = Method(
        "darker", lambda brdf: MODELS["lambert"](diffuse=(0.25, 0.25, 0.25)), "analytic"
    )
    values, reasons = measure(reference, "darker", darker)
    assert values.keys() == MEASURES.keys()
    assert not reasons
    assert values["size_bytes"] == 12
    assert values["max_albedo"] == pytest.approx(0.25, abs=1e-6)
    assert values["reciprocity_error"] == pytest.approx(0.0, abs=1e-9)
    assert values["noise"] == pytest.approx(0.0, abs=1e-9)
    assert values["relative_error"] == pytest.approx(0.5, abs=1e-6)
    assert values["directional_psnr_db"] is not None
    assert 5.0 < values["directional_psnr_db"] < 20.0

    itself = Method("itself", lambda brdf: brdf, "truth")
    values, reasons = measure(reference, "same", itself)
    assert values["environment_flip"] == 0.0
    assert values["environment_psnr_db"] is None
    assert reasons == dict.fromkeys(
        ["environment_psnr_db", "directional_psnr_db"], "the pictures are equal"
    )
    values, reasons = measure(reference, "truth", itself)
    assert values["fit_cpu_s"] is None
    assert reasons["environment_flip"] == "is the material itself"
    assert values["max_albedo"] == pytest.approx(0.5, abs=1e-6)


def test_codes_are_of_bases_that_have_not_seen_the_split(tmp_path: Path) -> None:
    def bases(split: Split) -> Bases:
        return Bases(split, None, PROTOCOLS["quick"], tmp_path / "cache", silent)

    included = bases(find_split("included"))
    assert included.facts("neural") == {"basis": find_basis("neural").fingerprint()}
    assert included("neural").fingerprint() == find_basis("neural").fingerprint()
    held_out = bases(find_split("merl-networks-1"))
    assert held_out.facts("neural")["basis"][:2] == ["neural", "merl-networks-1"]
    assert not (tmp_path / "cache").exists()


def test_bases_are_trained_on_the_training_materials_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainings = []

    def train(
        paths: Sequence[Path], kinds: Sequence[str], settings: CodeSettings, *_: Any
    ) -> dict[str, LatentBasis]:
        trainings.append(([path.stem for path in paths], list(kinds), settings.trained))
        return {kinds[0]: random_basis()}

    monkeypatch.setattr(module, "bases", train)
    few = Split("few", "", ("merl:steel",), ("merl:pink-felt", "merl:nylon"))
    bases = Bases(few, None, PROTOCOLS["quick"], tmp_path / "cache", silent)
    known = methods(PROTOCOLS["quick"], bases)
    assert not trainings  # naming methods trains nothing
    for _ in range(2):
        coded = known["neural"].fit(nacre.load("rgl:paper_white"))
        assert coded.nbytes is not None
    assert trainings == [(["pink-felt", "nylon"], ["neural"], 2)]


class Formula(Brdf):
    """Black, of no stored numbers."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        return (xp.maximum(0.0 * wi[2] * wo[2], 0.0),) * 3


def test_what_does_not_apply_is_said_to_be_missing() -> None:
    pytest.importorskip("skimage", reason="needs the extra 'render'")
    reference = Reference("gray", GRAY, PROTOCOLS["quick"])
    black = Method("black", lambda brdf: Formula(), "analytic")
    values, reasons = measure(reference, "black", black)
    assert {key for key, value in values.items() if value is None} == set(reasons)
    assert reasons["size_bytes"] == "f_r comes from a formula without stored numbers"
    assert reasons["noise"] == "reflects nothing"
    assert reasons["reciprocity_error"].startswith("reflects nothing")
