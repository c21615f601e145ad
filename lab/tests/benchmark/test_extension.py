"""The example package of the lab adds a method to the benchmark."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from nacre_lab.benchmark import METHODS, Method
from nacre_lab.benchmark.results import read_results
from nacre_lab.benchmark.run import _package_code
from tests.cli.support import run
from tests.packages import found_in, pip_installed

EXAMPLE = Path(__file__).parents[2] / "example"
MADE_HERE = Method("nothing", run, "analytic")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of packages that has the example, as pip installs it without a network."""
    return pip_installed(EXAMPLE, tmp_path_factory.mktemp("example"))


@pytest.fixture
def installed(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The example as an installed package; gives a folder to work in."""
    monkeypatch.chdir(tmp_path)
    with found_in(site, "nacre_lab_example", [METHODS], monkeypatch):
        yield tmp_path


def test_a_method_of_another_package_has_rows_in_the_benchmark(
    installed: Path, site: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command of the guide to the benchmark, short."""
    pytest.importorskip("skimage", reason="needs the extra 'render'")
    words = ["bench", "--methods", "half-angle,lambert", "--only", "rgl:satin_rosaline", "--quick"]
    assert run(*words, "-o", "results.jsonl") == 0
    own, lambert = read_results(Path("results.jsonl"))
    assert own.unavailable is None
    assert own.measures["size_bytes"] == 72
    assert own.measures["reciprocity_error"] == pytest.approx(0.0, abs=1e-6)
    for light in ("environment", "directional"):
        key = f"{light}_psnr_db"
        assert (own.measures[key] or 0.0) > (lambert.measures[key] or 0.0) + 1.0
    assert own.versions["nacre-lab-example"] == "0.1"
    assert "nacre-lab-example" not in lambert.versions
    assert run(*words, "-o", "results.jsonl") == 0
    assert len(Path("results.jsonl").read_text().splitlines()) == 2


def test_rows_of_a_method_go_by_the_code_of_its_module(installed: Path) -> None:
    method = METHODS["half-angle"]
    assert _package_code(method)
    assert _package_code(MADE_HERE) not in ("", _package_code(method))


def test_a_method_must_not_take_a_name(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(METHODS._members, "ggx", METHODS["half-angle"])
    assert run("bench", "--only", "rgl:satin_rosaline", "--quick") == 2
    assert not list(installed.glob("*.jsonl"))
