"""`nacre latent` from materials to a basis, a code and a table."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.cli import main
from nacre.latent.directions import shared_directions
from nacre.measured import merl
from tests.cli.support import run, run_json
from tests.latent.made import MATERIALS, NEW


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Materials, and a basis of them."""
    folder = tmp_path_factory.mktemp("trained")
    for index, make in enumerate(MATERIALS):
        nacre.save(make(), folder / f"made{index}.json")
    nacre.save(NEW, folder / "new.json")
    (folder / "empty").mkdir()
    names = [folder / f"made{index}.json" for index in range(len(MATERIALS))]
    basis = folder / "b.safetensors"
    assert run("latent", "train", *names, "-o", basis, "--code-dim", 9, *GRID) == 0
    return folder


@pytest.fixture
def folder(trained: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(trained, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


GRID = ["--resolution", "30,15,15"]


def test_a_material_goes_through_its_code(capsys, folder):
    names = [f"made{index}.json" for index in range(len(MATERIALS))]
    main(["latent", "train", *names, "-o", "o.safetensors", "--code-dim", "9", *GRID])
    assert "8 materials, latent size 9" in capsys.readouterr().out
    random = np.random.default_rng(1)
    w = random.normal(size=(2, 2000, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.3
    wi, wo = w / np.linalg.norm(w, axis=-1, keepdims=True)
    for options in ([], ["--no-refine"]):
        main(["latent", "encode", "new.json", "--basis", "o.safetensors", "-o", "c.json", *options])
        assert "9 values (36 bytes)" in capsys.readouterr().out
        table = f"x{len(options)}.binary"
        main(["latent", "decode", "c.json", "--basis", "o.safetensors", "-o", table])
        found, truth = nacre.load(table).eval(wi, wo), NEW.eval(wi, wo)
        assert np.median(np.abs(found - truth) / truth) < 0.1


def test_a_folder_stands_for_the_measured_files_in_it(capsys, folder):
    (folder / "tables").mkdir()
    for index in range(3):
        table = merl.tabulate(MATERIALS[index](), merl.Resolution(30, 15, 15))
        nacre.save(table, folder / f"tables/t{index}.binary")
    (folder / "tables" / "notes.txt").write_text("not a material")
    main(["latent", "train", "tables", "-o", "t.safetensors", "--code-dim", "3", *GRID])
    assert "3 materials, latent size 3" in capsys.readouterr().out


def test_info_tells_what_bases_and_codes_are(capsys, folder):
    main(["latent", "encode", "new.json", "--basis", "b.safetensors", "-o", "c.json"])
    basis, code = run_json(capsys, "info", "b.safetensors", "c.json")
    assert (basis["kind"], basis["code_dim"]) == ("basis", 9)
    assert (code["kind"], code["code_dim"]) == ("code", 9)
    (folder / "d.json").write_text('{"code of": 3}')
    assert run("info", "d.json") == 2
    assert "d.json: is not a whole code" in capsys.readouterr().err


NEURAL = ["--model", "neural", "--code-dim", "6", "--steps", "250"]


@pytest.mark.slow
def test_a_neural_basis_serves_alike(capsys, folder):
    pytest.importorskip("torch", reason="needs the extra 'latent'")
    names = [f"made{index}.json" for index in range(len(MATERIALS))]
    main(["latent", "train", *names, "-o", "n.safetensors", *NEURAL])
    assert "8 materials, latent size 6" in capsys.readouterr().out
    assert [path.name for path in folder.glob("n.*")] == ["n.safetensors"]
    main(["latent", "encode", "new.json", "--basis", "n.safetensors", "-o", "c.json"])
    assert "6 values (24 bytes)" in capsys.readouterr().out
    main(["latent", "decode", "c.json", "--basis", "n.safetensors", "-o", "x.binary"])
    wi, wo = shared_directions(2000, 1)
    found, truth = nacre.load("x.binary").eval(wi, wo), NEW.eval(wi, wo)
    assert np.median(np.abs(found - truth) / truth) < 0.2
    with pytest.raises(SystemExit):
        main(["latent", "encode", "new.json", "--basis", "n.safetensors", "-o", "d.json",
              "--no-refine"])  # fmt: skip
    assert "the basis 'neural' has no projection and no encoder" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["latent", "decode", "c.json", "--basis", "b.safetensors", "-o", "y.binary"])
    assert "is not a log-relative PCA code" in capsys.readouterr().err


@pytest.mark.slow
def test_a_hypernetwork_gives_networks(capsys, folder):
    pytest.importorskip("torch", reason="needs the extra 'latent'")
    names = [f"made{index}.json" for index in range(len(MATERIALS))]
    options = ["--model", "hypernetwork", "--code-dim", "6", "--steps", "200"]
    main(["latent", "train", *names, "-o", "h.safetensors", *options])
    assert "8 materials, latent size 6" in capsys.readouterr().out
    assert [path.name for path in folder.glob("h.*")] == ["h.safetensors"]
    main(["latent", "encode", "new.json", "--basis", "h.safetensors", "-o", "c.json"])
    for name in ("x.safetensors", "x.h5", "x.binary"):
        main(["latent", "decode", "c.json", "--basis", "h.safetensors", "-o", name])
    made = nacre.load("x.safetensors")
    assert made.sizes == (6, 21, 21, 3)
    wi, wo = shared_directions(2000, 1)
    found, truth = made.eval(wi, wo), NEW.eval(wi, wo)
    assert np.median(np.abs(found - truth) / truth) < 0.2
    np.testing.assert_array_equal(nacre.load("x.h5").eval(wi, wo), found)


@pytest.mark.slow
def test_an_autoencoder_gives_networks_with_or_without_its_encoder(capsys, folder):
    pytest.importorskip("torch", reason="needs the extra 'latent'")
    names = [f"made{index}.json" for index in range(len(MATERIALS))]
    options = ["--model", "autoencoder", "--code-dim", "6", "--steps", "150", "--mixtures", "40"]
    main(["latent", "train", *names, "-o", "a.safetensors", *options])
    assert "8 materials, latent size 6" in capsys.readouterr().out
    assert [path.name for path in folder.glob("a.*")] == ["a.safetensors"]
    wi, wo = shared_directions(2000, 1)
    truth = NEW.eval(wi, wo)
    errors = []
    for more in (["--no-refine"], []):
        main(["latent", "encode", "new.json", "--basis", "a.safetensors", "-o", "c.json", *more])
        main(["latent", "decode", "c.json", "--basis", "a.safetensors", "-o", "x.safetensors"])
        found = nacre.load("x.safetensors").eval(wi, wo)
        errors.append(np.median(np.abs(found - truth) / truth))
    assert errors[1] < min(0.3, errors[0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["train", "none.json", "made1.json", "-o", "x.safetensors"], "none.json: no such file"),
        (["frain"], "did you mean nacre latent train?"),
        (
            ["train", "made0.json", "-o", "x.safetensors"],
            "at least two materials, found only made0",
        ),
        (["train", "empty", "-o", "x.safetensors"], "empty: a basis needs at least two materials"),
        (["train", "made0.json", "-o", "x.safetensors", "--model", "gan"], "no known latent basis"),
        (["train", "made0.json", "made1.json", "-o", "x.npz"], "a .safetensors file"),
        (["train", "made0.json", "made1.json", "-o", "x.safetensors", *GRID], "not 32"),
        (["train", "made0.json", "-o", "x.safetensors", "--resolution", "3,4"], "like 90,45,45"),
        (
            ["train", "made0.json", "-o", "x.safetensors", "--steps", "3"],
            "steps is not a setting of the basis 'pca'",
        ),
        (
            ["train", "made0.json", "-o", "x.safetensors", *NEURAL, *GRID],
            "resolution is not a setting of the basis 'neural'",
        ),
        (["encode", "new.json", "--basis", "new.json", "-o", "c.json"], "safetensors"),
        (["encode", "none.json", "--basis", "b.safetensors", "-o", "c.json"], "none.json"),
        (["encode", "new.json", "--basis", "b.safetensors", "-o", "c.binary"], "a .json file"),
        (["encode", "new.json", "--basis", "b.safetensors", "-o", "new.json"], "is the input"),
        (["decode", "new.json", "--basis", "b.safetensors", "-o", "x.binary"], "whole code"),
    ],
)
def test_wrong_input_is_refused_and_leaves_nothing(folder, capsys, arguments, message):
    before = sorted(folder.iterdir())
    with pytest.raises(SystemExit) as stopped:
        main(["-q", "latent", *arguments])
    assert stopped.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert sorted(folder.iterdir()) == before
