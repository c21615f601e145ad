"""No material's lobes are predicted by a basis that was trained on it."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

import nacre
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.latent import save_basis
from nacre.latent.file import load_basis
from nacre.runtime.progress import silent
from nacre.sampling.parametrizations import PARAMETRIZATIONS
from nacre_lab.reproduce import EXPERIMENTS, unseen
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.codes import CodeSettings
from nacre_lab.reproduce.experiment import Request
from nacre_lab.reproduce.unseen import TooFewError, seen_by, separate, unseen_bases
from tests.latent.made import material, predictor, random_autoencoder, random_basis

SETTINGS = CodeSettings(code_dim=4, steps=3, mixtures=2, predictors=True)
KNOWN = ["Alum-Bronze", "acrylic_felt_pink_rgb"]


@pytest.fixture
def files(tmp_path):
    paths = [tmp_path / f"m{seed}.json" for seed in range(6)]
    for seed, path in enumerate(paths):
        nacre.save(material(seed), path)
    return paths


def named(paths, names):
    """Copies of files under other names."""
    return [shutil.copy(p, p.with_name(n)) for p, n in zip(paths, names, strict=True)]


def predicting(**changes):
    learned = {name: predictor(name) for name in PARAMETRIZATIONS}
    return replace(random_basis(), predictors=learned, **changes)


def test_materials_are_known_by_their_names_whatever_the_file(files):
    basis = predicting(metadata={"materials": KNOWN})
    names = ["alum_bronze.json", "acrylic-felt-pink_spec.json", "alum-bronze2.json"]
    assert seen_by(basis, named(files[:3], names)) == ["alum_bronze", "acrylic-felt-pink_spec"]
    with pytest.raises(NacreError, match="does not say which materials"):
        seen_by(random_basis(), files[:2])


def test_two_files_of_one_material_are_refused(files):
    copies = named([files[0], files[1]], ["other.json", "M0_rgb.json"])
    for copy in copies:
        with pytest.raises(NacreError, match="hold the same material"):
            separate([*files, copy], ())
    assert separate(files, ()) == (files, [])
    assert separate(files, ["m2"]) == ([files[2]], [p for p in files if p != files[2]])
    with pytest.raises(NacreError, match="m9: is not one of the materials"):
        separate(files, ["m9"])
    with pytest.raises(NacreError, match="leaves 1 materials to train on, expected 4 or more"):
        separate(files[:3], ["m0", "m1"])


def test_a_basis_that_has_seen_a_material_is_refused(files, tmp_path):
    def find(shown, given=None, kind="neural"):
        return unseen_bases(kind, shown, [], given, SETTINGS, Cache(tmp_path / "kept"), silent)

    mine = predicting(metadata={"materials": ["m1", "m2"]})
    with pytest.raises(NacreError, match="the given basis was trained on m1, m2; give another"):
        find(files, mine)
    assert find([files[0]], mine).of(load_brdf(files[0])) is mine
    known = named(files[:2], ["nylon.json", "strange.json"])
    with pytest.raises(NacreError, match="included basis was trained on nylon; give 5 materials"):
        find(known)
    brdf = load_brdf(known[1])
    assert find(known[1:]).of(brdf).kind == "neural"
    with pytest.raises(TooFewError, match="no basis 'autoencoder' is included"):
        find(known[1:], kind="autoencoder")


def test_every_material_gets_a_basis_of_the_others(files, tmp_path, monkeypatch):
    pytest.importorskip("torch", reason="needs the extra 'latent'")
    monkeypatch.setattr(unseen, "PRETRAINED", ())
    monkeypatch.setattr(unseen, "_FOLDS", 2)
    folder = tmp_path / "kept"
    found = unseen_bases("neural", files, [], None, SETTINGS, Cache(folder), silent)
    assert len({id(basis) for basis in found.by_hash.values()}) == 2
    assert len(found.fingerprint().split()) == 2
    for path in files:
        brdf = load_brdf(path)
        basis = found.of(brdf)
        assert set(basis.predictors) == set(PARAMETRIZATIONS)
        trained = basis.metadata["materials"]
        assert brdf.name not in trained
        assert len(trained) == 3
    stages = []
    again = unseen_bases(
        "neural", files, [], None, SETTINGS, Cache(folder), lambda stage, *_: stages.append(stage)
    )
    assert again.fingerprint() == found.fingerprint()
    assert not stages
    shown, others = separate(files, ["m3"])
    one = unseen_bases("neural", shown, others, None, SETTINGS, Cache(folder), silent)
    assert sorted(one.of(load_brdf(files[3])).metadata["materials"]) == [
        f"made {seed}" for seed in (0, 1, 2, 4, 5)
    ]


def test_an_autoencoder_is_trained_with_both_kinds_of_predictors(files, tmp_path):
    pytest.importorskip("torch", reason="needs the extra 'latent'")
    shown, others = separate(files, ["m5"])
    found = unseen_bases("autoencoder", shown, others, None, SETTINGS, Cache(tmp_path), silent)
    basis = found.of(load_brdf(files[5]))
    assert set(basis.predictors) == {*PARAMETRIZATIONS, "blinn-phong by labels", "ggx by labels"}
    assert basis.orders().shape == (5, 6, 4)
    # The encoder's codes of the materials in all orders are what codes are scaled by.
    assert np.abs(basis.orders()).max() < 10.0
    (kept,) = tmp_path.glob("basis-*.safetensors")
    assert load_basis(kept).fingerprint(predictors=True) == basis.fingerprint(predictors=True)


def test_figures_say_what_predicted_and_leave_out_what_cannot(files, tmp_path):
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    path = tmp_path / "basis.safetensors"
    save_basis(predicting(metadata={"materials": ["m1"]}), path)
    request = Request(files[:1], tmp_path / "kept", basis=path, quick=True, methods=["uniform"])
    figure = EXPERIMENTS["fig14"]
    asked = replace(request, methods=["paper-ggx"])
    with pytest.raises(NacreError, match="no basis 'autoencoder' is included; give 5 materials"):
        figure.run("fig14", asked)
    with pytest.raises(NacreError, match="was trained on m1; give another"):
        figure.run("fig14", replace(request, files=files[:2], methods=["ggx-predicted"]))
    save_basis(random_autoencoder(), tmp_path / "plain.safetensors")
    with pytest.raises(NacreError, match="predicts no lobes"):
        figure.run("fig14", replace(asked, basis=tmp_path / "plain.safetensors"))
