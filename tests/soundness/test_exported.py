"""Exported C, compiled and checked."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import nacre
from nacre.analytic import Ggx
from nacre.errors import FormatError, NacreError
from nacre.soundness import Plan, check
from nacre.soundness.exported import ExportedC

needs_compiler = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="needs a C compiler"
)
NOT_RECIPROCAL = """
#include <stddef.h>
static inline void own_eval_n(size_t n, const float *wi, const float *wo, float *rgb) {
    for (size_t k = 0; k < 3 * n; ++k)
        rgb[k] = wi[3 * (k / 3) + 2] > 0.0f && wo[3 * (k / 3) + 2] > 0.0f
            ? 0.1f + 0.1f * wi[3 * (k / 3) + 2] * wi[3 * (k / 3) + 2] : 0.0f;
}
"""


def exported(brdf: nacre.Brdf, folder: Path) -> Path:
    path = folder / "paint.h"
    nacre.export(brdf, "c", output=path)
    return path


@needs_compiler
def test_an_exported_model_is_sound(tmp_path: Path) -> None:
    brdf = Ggx(name="paint", diffuse=(0.3, 0.2, 0.1), specular=(0.05,) * 3, roughness=0.2)
    brdf = brdf.replaced(sampler=nacre.sampling.fit.fit_lobes(brdf))
    found = check(ExportedC(exported(brdf, tmp_path)), Plan(samples=1 << 15))
    assert found.sound
    passed = [each.property for each in found.results if each.state == "passed"]
    assert set(passed) >= {"energy", "reciprocity", "chi-square", "area", "normalization"}


@needs_compiler
def test_an_exported_network_is_excused_as_the_network_is(tmp_path: Path) -> None:
    path = exported(nacre.load("rgl:satin_rosaline"), tmp_path)
    found = nacre.check(path, only=["energy", "reciprocity"])
    assert found["reciprocity"].state == "by design"
    assert found["energy"].size == pytest.approx(1.15, abs=0.01)


@needs_compiler
def test_a_fault_in_c_is_found(tmp_path: Path) -> None:
    path = tmp_path / "own.c"
    path.write_text(NOT_RECIPROCAL)
    found = nacre.check(path)
    assert [each.property for each in found.report.results if each.state == "failed"] == [
        "reciprocity"
    ]
    assert found["chi-square"].state == "not applicable"


@needs_compiler
def test_bad_c_is_refused_in_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "own.h"
    path.write_text("int f(void);\n")
    with pytest.raises(FormatError, match="has no function NAME_eval_n"):
        nacre.check(path)
    path.write_text(NOT_RECIPROCAL + "int x")
    with pytest.raises(FormatError, match=r"own\.h: does not compile: .*error"):
        nacre.check(path)
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(NacreError, match="needs a C compiler"):
        nacre.check(path)
