"""The example package adds a member of each family, and nothing inside nacre knows of it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre import formats
from nacre.analytic import MODELS
from nacre.analytic.lambert import Lambert
from nacre.formats import FORMATS
from nacre.latent import BASES, load_basis, load_code
from nacre.neural import NeuralBrdf
from nacre.neural.training import initial_layers
from nacre.sampling import SAMPLERS
from nacre.targets import TARGETS
from nacre.textures import LatentMap
from nacre.textures.codecs import CODECS, load_codec
from nacre.textures.codecs.codec_file import codec_facts
from nacre.textures.plan import candidate_pairs, informative
from nacre.workflows.codec_training import train_codec
from nacre.workflows.encoding import encode_texture
from tests.cli.support import run
from tests.latent.made import MATERIALS, NEW
from tests.oracles.materials import material
from tests.packages import found_in, pip_installed
from tests.textures.codecs.networks.made import OTHER, texture, write

EXAMPLE = Path(__file__).parents[1] / "docs" / "examples"
"""The source tree of the package `nacre-example`."""
REGISTRIES = (FORMATS, MODELS, SAMPLERS, BASES, CODECS, TARGETS)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of packages that has the example, as pip installs it without a network."""
    return pip_installed(EXAMPLE, tmp_path_factory.mktemp("example"))


@pytest.fixture
def installed(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The example as an installed package; gives a folder to work in."""
    monkeypatch.chdir(tmp_path)
    with found_in(site, "nacre_example", REGISTRIES, monkeypatch):
        yield tmp_path


def test_the_package_has_a_member_of_each_family(installed: Path) -> None:
    for registry in REGISTRIES:
        brought = [
            member
            for _, member in registry.members()
            if type(member).__module__.startswith("nacre_example")
            or getattr(member, "__module__", "").startswith("nacre_example")
            or getattr(getattr(member, "load", None), "__module__", "") == "nacre_example.format"
        ]
        assert len(brought) == 1, registry.what


@pytest.mark.slow
def test_the_package_keeps_the_contracts_by_a_suite_of_its_own(site: Path, tmp_path: Path) -> None:
    """Outside of the checkout, with what is installed."""
    shutil.copytree(EXAMPLE / "tests", tmp_path / "tests")
    path = os.pathsep.join([str(site), *filter(None, sys.path)])
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": path},
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout
    last = done.stdout.splitlines()[-1]
    assert "1 xfailed" in last
    assert int(last.split(" passed")[0].split()[-1]) > 70


@pytest.mark.slow
def test_a_format_of_another_package_serves_the_commands(installed: Path, site: Path) -> None:
    """In a process of its own, as a user has it."""
    truth = MATERIALS[0]()
    nacre.save(truth, installed / "paint.json")
    path = os.pathsep.join([str(site), *filter(None, sys.path)])

    def python(*words: str) -> str:
        done = subprocess.run(
            [sys.executable, *words],
            env={**os.environ, "PYTHONPATH": path},
            check=False,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    python("-c", "import nacre; nacre.save(nacre.load('paint.json'), 'paint.polar')")
    assert "paint" in python("-m", "nacre", "info", "paint.polar")
    python("-m", "nacre", "compare", "paint.json", "paint.polar")
    back = nacre.load("paint.polar")
    assert formats.identify("paint.polar") is next(iter(formats.formats()))
    wi, wo = np.array([[0.6, 0.0, 0.8]]), np.array([[0.0, 0.28, 0.96]])
    np.testing.assert_allclose(back.eval(wi, wo), truth.eval(wi, wo), rtol=0.02)
    Path("cut.polar").write_bytes(Path("paint.polar").read_bytes()[:1000])
    with pytest.raises(nacre.FormatError, match=r"cut\.polar: is not a whole polar table"):
        nacre.load("cut.polar")


def test_a_member_that_does_not_load_is_left_out_with_a_warning(
    installed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "nacre_example.format", None)
    with pytest.warns(RuntimeWarning, match="'polar table' of the package nacre-example does not"):
        found = formats.formats()
    assert "polar table" not in [entry.name for entry in found]
    assert len(found) > 10


def test_a_codec_of_another_package_is_trained_encodes_and_plans(installed: Path) -> None:
    files = write(installed, 2)
    trained = installed / "model.safetensors"
    assert train_codec(files, trained, model="cosines", texels=9, seed=1) is not None
    facts = codec_facts(trained)
    assert (facts["model"], facts["latent size"], facts["functions"]) == ("cosines", 21, 7)
    assert facts["materials in training"] == 2
    codec = load_codec(trained)
    assert type(codec) is CODECS["cosines"]

    encoded = encode_texture(files[0], installed / "felt.safetensors", model=trained)
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


def test_a_command_of_another_package_is_listed_and_runs(installed: Path, site: Path) -> None:
    nacre.save(Lambert(diffuse=(0.5, 0.25, 0.125)), installed / "gray.json")
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(site), *filter(None, sys.path)]),
    }

    def printed(*words: str) -> str:
        command = [sys.executable, "-m", "nacre", *words]
        return subprocess.run(
            command, env=environment, check=True, capture_output=True, text=True
        ).stdout

    assert "brightness  Print which part of the light from one direction" in printed()
    assert "--incidence DEG" in printed("help", "brightness")
    found = json.loads(printed("brightness", "gray.json", "--json"))
    assert list(found.values()) == pytest.approx([0.5, 0.25, 0.125], rel=1e-3)


@pytest.mark.skipif(shutil.which("node") is None, reason="Node.js is not installed")
def test_a_target_of_another_package_writes_what_runs(installed: Path) -> None:
    fitted = material("glossy")
    nacre.save(fitted, installed / "gloss.safetensors")
    assert run("export", "gloss.safetensors", "--to", "javascript") == 0
    wi, wo, u = [0.6, 0.0, 0.8], [0.0, 0.28, 0.96], [0.9, 0.3, 0.7]
    script = f"""import * as m from "./gloss.mjs";
    console.log(JSON.stringify([m.gloss_eval({wi}, {wo}), m.gloss_pdf({wi}, {wo}),
                                m.gloss_sample({wo}, {u})]))"""
    Path("try.mjs").write_text(script, encoding="utf-8")
    done = subprocess.run(["node", "try.mjs"], check=True, capture_output=True, text=True)
    rgb, pdf, drawn = json.loads(done.stdout)
    np.testing.assert_allclose(rgb, fitted.eval(*np.array([wi, wo])), rtol=1e-5)
    np.testing.assert_allclose(pdf, fitted.pdf(*np.array([wi, wo])), rtol=1e-5)
    directions, density = fitted.sample(*np.array([wo, u]))
    np.testing.assert_allclose(drawn, [*directions, density], rtol=1e-4, atol=1e-6)
