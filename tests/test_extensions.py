"""The example package adds a member of each family, and nothing inside nacre knows of it."""

from __future__ import annotations

import importlib
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS
from nacre.latent import BASES, load_basis, load_code
from nacre.neural import NeuralBrdf
from nacre.neural.training import initial_layers
from nacre.sampling import SAMPLERS
from nacre.textures import LatentMap
from nacre.textures.codecs import CODECS, load_codec
from nacre.textures.codecs.codec_file import codec_facts
from nacre.textures.plan import candidate_pairs, informative
from nacre.workflows.codec_training import train_codec
from nacre.workflows.encoding import encode_texture
from tests.cli.support import run
from tests.latent.made import MATERIALS, NEW
from tests.textures.codecs.networks.made import OTHER, texture, write

EXAMPLE = Path(__file__).parents[1] / "docs" / "examples" / "nacre_example"
ENTRY_POINTS = """
[nacre.bases]
lobes = nacre_example.basis:LobeBasis
[nacre.codecs]
cosines = nacre_example.codec:CosineCodec
[nacre.models]
minnaert = nacre_example.model:Minnaert
[nacre.samplers]
power-cosine = nacre_example.sampler:PowerCosine
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The example as an installed package; gives a folder to work in."""
    site = tmp_path / "site"
    shutil.copytree(EXAMPLE, site / "nacre_example")
    facts = site / "nacre_example-0.1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: nacre-example\nVersion: 0.1\n")
    (facts / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(site)
    for registry in (BASES, CODECS, MODELS, SAMPLERS):
        monkeypatch.setattr(registry, "_entry_points", None)
        monkeypatch.setattr(registry, "_members", {})
    importlib.invalidate_caches()
    yield tmp_path
    for name in [name for name in sys.modules if name.partition(".")[0] == "nacre_example"]:
        del sys.modules[name]


def test_a_codec_of_another_package_is_trained_encodes_and_plans(installed: Path) -> None:
    files = write(installed, 2)
    trained = train_codec(files, installed / "model.safetensors", model="cosines", texels=9, seed=1)
    assert trained is not None
    facts = codec_facts(trained.path)
    assert (facts["model"], facts["latent size"], facts["functions"]) == ("cosines", 21, 7)
    assert facts["materials in training"] == 2
    codec = load_codec(trained.path)
    assert type(codec) is CODECS["cosines"]

    encoded = encode_texture(files[0], installed / "felt.safetensors", model=trained.path)
    made = nacre.load(encoded.path)
    truth = texture(0).texels(slice(None))
    assert np.square(made.texels(slice(None)) - truth).mean() < 0.1 * np.square(truth).mean()
    assert made.at_directions(*OTHER).pair_count == len(OTHER[0])
    points = codec.embedding(*OTHER)(encoded.latent.codes.reshape(-1, 21))
    assert np.isfinite(points).all()
    assert isinstance(made.latent, LatentMap)

    wi, wo = candidate_pairs(16)
    assert len(set(informative(codec, wi, wo, 5).tolist())) == 5


def test_what_a_codec_cannot_do_is_said(installed: Path) -> None:
    with pytest.raises(nacre.NacreError, match="latent_size is for models of kind none"):
        train_codec([], installed / "model.safetensors", model="cosines", latent_size=3)
    with pytest.raises(nacre.NacreError, match="21 values, expected 4"):
        CODECS["cosines"](np.ones(7, np.float32), 1.0).first(4)


def test_a_latent_basis_of_another_package_serves_the_commands(
    installed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(installed)
    names = [f"made{index}.json" for index in range(4)]
    for name, make in zip(names, MATERIALS, strict=False):
        nacre.save(make(), installed / name)
    nacre.save(NEW, installed / "new.json")
    options = ["--model", "lobes", "--code-dim", "4", "-o", "b.safetensors"]
    assert run("latent", "train", *names, *options) == 0
    basis = load_basis("b.safetensors")
    assert type(basis) is BASES["lobes"]
    assert (basis.code_dim, basis.describe()["materials in training"]) == (4, 4)
    assert run("latent", "encode", "new.json", "--basis", "b.safetensors", "-o", "c.json") == 0
    decoded = load_code("c.json", basis)
    wi, wo = np.array([[0.6, 0.0, 0.8], [0.0, 0.1, 0.995**0.5]]).repeat(2, 0), np.eye(3)[[2] * 4]
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    truth = NEW.eval(wi, wo).mean(axis=1)
    np.testing.assert_allclose(decoded.eval(wi, wo).mean(axis=1), truth, rtol=0.5)
    assert run("latent", "decode", "c.json", "--basis", "b.safetensors", "-o", "x.binary") == 0
    assert run("latent", "train", *names, "--steps", "5", *options) == 2
    assert run("latent", "encode", "new.json", "--basis", "b.safetensors", "--no-refine",
               "-o", "d.json") == 2  # fmt: skip


def test_an_analytic_model_of_another_package_is_fitted_and_stored(
    installed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(installed)
    truth = MODELS["minnaert"](diffuse=(0.3, 0.2, 0.1), k=1.5, name="moon")
    nacre.save(truth, "moon.json")
    assert repr(nacre.load("moon.json")) == repr(truth)
    fitted = nacre.analytic.fit(truth, MODELS.find("minnaert"), samples=500, starts=4)
    np.testing.assert_allclose(fitted.values["k"], 1.5, rtol=1e-3)
    assert run("fit", "moon.json", "--model", "minnaert", "-o", "again.json") == 0
    wi = np.array([[0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
    again = nacre.load("again.json").eval(wi, wi[::-1])
    np.testing.assert_allclose(again, truth.eval(wi, wi[::-1]), rtol=1e-3)


def test_a_sampler_of_another_package_stays_with_a_network(
    installed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = installed / "network.safetensors"
    sampler = SAMPLERS["power-cosine"](3.0)
    network = NeuralBrdf(initial_layers((4,), 0), sampler=sampler)
    nacre.save(network, path)
    loaded = nacre.load(path)
    assert loaded.sampler == sampler
    wo = np.array([0.0, 0.6, 0.8])
    u = np.random.default_rng(0).random((20_000, 3))
    wi, pdf = loaded.sample(wo, u)
    np.testing.assert_allclose(loaded.pdf(wi, wo), pdf, rtol=1e-12)
    assert (1.0 / pdf).mean() == pytest.approx(2.0 * np.pi, rel=0.2)  # of the hemisphere

    monkeypatch.setattr(SAMPLERS, "_entry_points", {})
    monkeypatch.setattr(SAMPLERS, "_members", {})
    with pytest.raises(nacre.FormatError, match="'power-cosine'; update nacre, or install the pa"):
        nacre.load(path)
