"""The face of the package: its names, and where missing libraries send people."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import nacre
from nacre.analytic.lambert import Lambert
from nacre.errors import DISTRIBUTION, MissingExtraError, require

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_every_public_name_is_there_after_one_import():
    code = "import nacre; print(*[type(getattr(nacre, n)).__name__ for n in nacre.__all__])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert len(done.stdout.split()) == len(nacre.__all__)
    assert {*nacre.__all__, "__doc__"} <= set(dir(nacre))
    assert all(hasattr(nacre, name) for name in dir(nacre))


def test_interfaces_are_attributes_of_the_package():
    done = subprocess.run(
        [sys.executable, "-c", "import nacre; print(nacre.btf.Btf is nacre.Btf)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "True\n"


def test_the_distribution_is_named_as_hints_say():
    assert PROJECT["name"] == DISTRIBUTION
    assert all("nacre[" not in need for need in PROJECT["optional-dependencies"]["all"])
    assert set(PROJECT["scripts"]) == {"nacre"}


def test_a_missing_library_is_hinted_at_with_the_distribution_and_an_extra_that_brings_it():
    with pytest.raises(MissingExtraError, match=r"pip install 'nacre-materials\[plot\]'"):
        require("no_such_library", "plot")


def required(module: Path) -> list[tuple[str, str]]:
    """The libraries that a module asks for, each with the extra that it names."""
    calls = [
        node
        for node in ast.walk(ast.parse(module.read_text()))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "require"
    ]
    return [
        (call.args[0].value.partition(".")[0], call.args[1].value)
        for call in calls
        if isinstance(call.args[0], ast.Constant)
    ]


def test_extras_that_hints_name_bring_the_library():
    brought_by = {"PIL": "pillow", "skimage": "scikit-image", "flip_evaluator": "flip-evaluator"}
    brought_by |= {"colour": "colour-science", "dask": "distributed"}
    extras = PROJECT["optional-dependencies"]
    asked = {pair for path in (ROOT / "src").rglob("*.py") for pair in required(path)}
    assert len(asked) > 10
    for library, extra in asked:
        name = brought_by.get(library, library)
        assert any(need.startswith(name) for need in extras[extra]), (library, extra)


def test_texture_networks_name_their_own_extra_for_pytorch():
    code = """
import sys
sys.modules["torch"] = None
import nacre.textures.codecs.networks.training
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "pip install 'nacre-materials[btf]'" in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="needs address space limits that hold")
def test_too_little_memory_is_a_line_wherever_it_shows(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource", reason="needs limits of a process")
    nacre.save(Lambert(diffuse=(0.5, 0.5, 0.5)), tmp_path / "gray.json")
    quick = ("--epochs", "1", "--samples", "2000", "-o", tmp_path / "x.safetensors")
    for size in (300 << 20, 400 << 20, 500 << 20):
        done = subprocess.run(
            [sys.executable, "-m", "nacre", "-q", "fit", tmp_path / "gray.json", *quick],
            preexec_fn=lambda size=size: resource.setrlimit(resource.RLIMIT_AS, (size, size)),
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )
        assert (done.returncode, done.stderr.count("\n")) in ((2, 1), (0, 0)), done.stderr
        assert done.returncode == 0 or "memory" in done.stderr
