"""The registry of methods: sizes, and what they refuse."""

from __future__ import annotations

from functools import partial

import pytest

import nacre
from lab.tests.reproduce.support import SETTINGS, write_materials
from nacre.errors import NacreError
from nacre.io.files import digest
from nacre.latent import PcaBasis, PcaRecipe
from nacre.latent.file import save_basis
from nacre.measured.merl import Resolution
from nacre.neural import NeuralBrdf
from nacre.neural.training import initial_layers
from nacre_lab.reproduce.methods import SIZES, methods
from nacre_lab.reproduce.trial import Settings
from tests.reflectances import Brushed, Glossy


def test_networks_have_the_weights_that_their_names_say():
    known = methods(Settings())
    for name, hidden in SIZES.items():
        network = NeuralBrdf(initial_layers(hidden, 0))
        assert name == f"nbrdf-{network.weight_count}"
        assert known[name].settings["recipe"]["hidden"] == hidden
    assert known["nbrdf-675-uniform"].settings["recipe"]["sampling"] == "hemisphere"
    assert known["nbrdf-675-adaptive"].settings["recipe"]["sampling"] == "rusinkiewicz"


def test_methods_have_the_memory_that_their_names_say():
    truth, known = Glossy(0.3, 0.05, 0.3), methods(SETTINGS)
    sizes = {
        name: known[name].fit(truth).nbytes
        for name in ("lambert", "npf", "nbrdf-105", "enhanced-298", "stereographic-685")
    }
    assert list(sizes.values()) == [12, 3264, 420, 596, 2740]
    assert 47 * 1024 < known["rgl-48k"].fit(truth).nbytes <= 48 * 1024


def test_published_networks_are_found_by_the_name_of_the_material(tmp_path):
    (path, other) = write_materials(tmp_path)
    folder = tmp_path / "networks"
    folder.mkdir()
    nacre.save(nacre.load(path), folder / "a.h5")
    published = methods(SETTINGS, [tmp_path, folder])["published"]
    assert published.fit(nacre.load(path)).weight_count == 83
    with pytest.raises(NacreError, match=r"no published network b\.h5"):
        published.fit(nacre.load(other))


def test_published_networks_are_told_apart_as_they_are_chosen(tmp_path):
    folders = [tmp_path / name for name in ("first", "second")]
    path, other = write_materials(tmp_path)
    for folder, material in zip(folders, (path, other), strict=True):
        folder.mkdir()
        nacre.save(nacre.load(material), folder / "a.h5")
    before, after = (methods(SETTINGS, order)["published"] for order in (folders, folders[::-1]))
    assert before.settings != after.settings
    shown = {"networks": {"a.h5": digest(folders[0] / "a.h5")}}
    assert before.settings == shown


FIT = "= Aggregate(Lambertian(albedo = [0.1, 0.2, 0.3]), LowSmooth(A = [5.0, 3.0, 2.0], B = 500.0, "
FITS = {"smooth.fit": f"a {FIT}C = 1.3, eta = 1.6))\n", "he.fit": f"a {FIT}))".replace("Low", "He")}


def test_published_tables_are_methods_of_their_own(tmp_path):
    (path, other) = write_materials(tmp_path)
    folder = tmp_path / "fits"
    folder.mkdir()
    for name, text in FITS.items():
        (folder / name).write_text(text)
    known = methods(SETTINGS, [tmp_path, folder])
    smooth, he = (known[f"published-{name}"] for name in ("smooth", "he"))
    assert smooth.settings == {"table": digest(folder / "smooth.fit")}
    found = smooth.fit(nacre.load(path))
    assert (found.model, found.values["b"], found.nbytes) == ("abc-smooth", 500.0, 36)
    with pytest.raises(NacreError, match=r"smooth\.fit: no material of this name"):
        smooth.fit(nacre.load(other))
    with pytest.raises(NacreError, match=r"he\.fit: .* 'HeSmooth' is not one of"):
        he.fit(nacre.load(path))


def test_codes_are_of_the_basis_given(tmp_path):
    materials = [partial(Glossy, 0.1 * k, 0.05, 0.2 + 0.1 * k) for k in range(4)]
    basis = PcaBasis.train(materials, PcaRecipe(3, Resolution(12, 8, 8)))
    save_basis(basis, tmp_path / "basis.safetensors")
    known = methods(SETTINGS, basis=tmp_path / "basis.safetensors")["pca"]
    assert "3 values" in known.about
    assert known.fit(Glossy(0.15, 0.05, 0.35)).nbytes == 12
    none = methods(SETTINGS)["pca"]
    assert none.settings != known.settings
    with pytest.raises(NacreError, match="needs --basis"):
        none.fit(Glossy(0.15, 0.05, 0.35))
    with pytest.raises(NacreError, match=r"missing\.safetensors"):
        methods(SETTINGS, basis=tmp_path / "missing.safetensors")


def test_methods_refuse_materials_that_they_cannot_hold():
    known = methods(SETTINGS)
    with pytest.raises(NacreError, match="does not fit into 48 KB"):
        known["rgl-48k"].fit(Brushed())
    with pytest.raises(NacreError, match="on isotropic ones it is ggx"):
        known["ggx-anisotropic"].fit(Glossy(0.3, 0.05, 0.3))
