"""`nacre convert` of reflectances: what a table loses, and what --physical makes of one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.formats import load_brdf
from nacre.geometry import join, uniform_hemisphere
from nacre.measured import MbsdfBrdf
from nacre.metrics.physics import albedo
from tests.cli.support import assert_refused, run_json


@pytest.fixture
def bright(tmp_path: Path) -> Path:
    """A table that is not reciprocal and reflects up to twice the light."""
    values = np.random.default_rng(0).uniform(0.1, 0.5, (6, 6, 6, 3))
    values[:, 3:] += 0.3
    nacre.save(MbsdfBrdf(values), tmp_path / "bright.mbsdf")
    return tmp_path / "bright.mbsdf"


@pytest.mark.parametrize(
    ("name", "resolution", "error"),
    [("x.mbsdf", "9,9", 1e-6), ("x.binary", "20,20,20", 1e-6), ("x.bsdf", "1,12,24,24,48", 0.15)],
)
def test_what_is_written_physical_is_so(
    bright: Path, tmp_path: Path, capsys: Any, name: str, resolution: str, error: float
) -> None:
    output = tmp_path / name
    options = "-o", output, "--physical", "--resolution", resolution
    change = run_json(capsys, "convert", bright, *options)["physical"]
    before, after = load_brdf(bright), load_brdf(output)
    theta = np.radians([0.0, 20.0, 40.0, 60.0, 75.0, 85.0, 89.0])
    assert albedo(before, theta).value.max() > 1.5
    assert change["albedo"][0] > 1.5
    found = albedo(after, theta)
    assert (found.value <= 1.0 + 3.0 * found.error + 1e-3).all()
    assert found.value.max() > 0.8
    assert change["reciprocity"][0] > 0.1
    assert change["reciprocity"][1] <= error
    u = np.random.default_rng(1).random((2, 2, 500))
    wi, wo = (join(uniform_hemisphere(*part)) for part in u)
    # By what renderers see: within a degree of the horizon, tables of f_r cos hold no f_r.
    weight = (wi[:, 2] * wo[:, 2])[:, None]
    difference = (weight * np.abs(after.eval(wi, wo) - after.eval(wo, wi))).mean()
    assert difference <= max(error, 1e-5) * (weight * after.eval(wi, wo)).mean()
    assert change["median"] > 0.05


def test_a_table_says_what_it_lost_and_a_copy_nothing(
    bright: Path, tmp_path: Path, capsys: Any
) -> None:
    assert "table_error_median" not in run_json(
        capsys, "convert", bright, "-o", tmp_path / "a.mbsdf"
    )
    said = run_json(capsys, "convert", bright, "-o", tmp_path / "b.mbsdf", "--resolution", "5,7")
    coarse, fine = load_brdf(tmp_path / "b.mbsdf"), load_brdf(bright)
    rng = np.random.default_rng(2)
    wi, wo = (join(uniform_hemisphere(*rng.random((2, 2000)))) for _ in range(2))
    f = fine.eval(wi, wo)
    median = np.median(np.abs(coarse.eval(wi, wo) - f) / f)
    assert said["table_error_median"] == pytest.approx(median, rel=0.3)


def test_networks_become_physical_by_a_fit(bright: Path, tmp_path: Path, capsys: Any) -> None:
    arguments = "convert", bright, "-o", tmp_path / "x.safetensors", "--physical"
    assert_refused(capsys, "nacre fit --physical", *arguments)
