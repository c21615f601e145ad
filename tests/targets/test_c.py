"""C headers in programs of their users."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from nacre.array import Components, namespace
from nacre.brdf import Brdf
from nacre.targets import TARGETS
from tests.oracles.materials import material
from tests.oracles.pairs import pairs
from tests.oracles.runners.native import WARNINGS, Gcc, build
from tests.targets.test_source import HOSTILE
from tests.tiers import tiered

pytestmark = pytest.mark.skipif(not shutil.which("g++"), reason="g++ is not installed")


def header(brdf: Brdf, name: str) -> dict[str, bytes]:
    return dict(TARGETS["c"]().files(brdf, name))


def output(command: list[str], code: str, files: dict[str, bytes], folder: Path) -> np.ndarray:
    """Numbers that a program prints."""
    build([*command, *WARNINGS, "-I."], code, files, folder / "program")
    result = subprocess.run([folder / "program"], capture_output=True, check=True, text=True)
    return np.array(result.stdout.split(), np.float64)


TWO_MATERIALS = r"""
#include "gloss.h"
#include "ggx.h"
#include "gloss.h"
#include <stdio.h>
int main(void) {
    const float wi[3] = {0.6f, 0.0f, 0.8f}, wo[3] = {-0.48f, 0.6f, 0.64f};
    const float u[3] = {0.3f, 0.4f, 0.9f};
    float rgb[3], drawn[3], density;
    gloss_eval(wi, wo, rgb);
    printf("%.9g %.9g %.9g\n", (double)rgb[0], (double)rgb[1], (double)rgb[2]);
    ggx_eval(wi, wo, rgb);
    printf("%.9g %.9g %.9g\n", (double)rgb[0], (double)rgb[1], (double)rgb[2]);
    gloss_sample(wo, u, drawn, &density);
    printf("%.9g %.9g\n", (double)gloss_pdf(wi, wo), (double)(density - gloss_pdf(drawn, wo)));
    return 0;
}
"""


@pytest.mark.parametrize(
    "tool",
    tiered(
        ["gcc -std=c99", "gcc -std=c11", "g++ -std=c++11", "g++ -std=c++17"],
        ["gcc -std=c99", "g++ -std=c++17"],
    ),
)
def test_two_materials_in_a_program(tool: str, tmp_path: Path) -> None:
    gloss, ggx = (material(name) for name in ("glossy", "ggx"))
    files = header(gloss.replaced(name="\n".join(HOSTILE)), "gloss") | header(ggx, "ggx")
    language = "c++" if "++" in tool else "c"
    found = output([*tool.split(), "-x", language], TWO_MATERIALS, files, tmp_path)
    wi, wo = np.array([0.6, 0.0, 0.8]), np.array([-0.48, 0.6, 0.64])
    expected = [*gloss.eval(wi, wo), *ggx.eval(wi, wo), gloss.pdf(wi, wo), 0.0]
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)


ELEMENTARY = r"""
#include "ggx.h"
#include <stdio.h>
int main(void) {
    int k;
    for (k = 0; k < 2000; k++) {
        const float x = (float)k / 20.0f - 50.0f, part = (float)k / 1000.0f - 1.0f;
        const float power = nacre_exp(x);
        printf("%.9g %.9g ", (double)x, (double)part);
        printf("%.9g %.9g ", (double)power, (double)nacre_log(power));
        printf("%.9g %.9g ", (double)nacre_sqrt(power), (double)nacre_sin(x));
        printf("%.9g ", (double)nacre_cos(x));
        printf("%.9g %.9g\n", (double)nacre_arcsin(part), (double)nacre_arctan2(part, x));
    }
    return 0;
}
"""


@pytest.mark.parametrize("options", ["-O2", "-O2 -march=native", "-O3 -march=native -ffast-math"])
def test_elementary_functions(options: str, tmp_path: Path) -> None:
    command = ["gcc", "-std=c99", "-x", "c", *options.split()]
    found = output(command, ELEMENTARY, header(material("ggx"), "ggx"), tmp_path).reshape(-1, 9)
    x, part = (column.astype(np.float32).astype(np.float64) for column in found[:, :2].T)
    power = found[:, 2]
    expected = [np.exp(x), np.log(power), np.sqrt(power), np.sin(x), np.cos(x)]
    expected += [np.arcsin(part), np.arctan2(part, x)]
    np.testing.assert_allclose(found[:, 2:], np.stack(expected, 1), rtol=1e-6, atol=2e-7)


class Uneven(Brdf):
    """Two layers, between which every unit is treated differently."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp, random = namespace(*wi, *wo), np.random.default_rng(0)

        def layer(*shape: int) -> np.ndarray:
            return random.normal(0.0, 0.5, shape).astype(np.float32)

        values = xp.dense((*wi, *wo), layer(6, 14), layer(14))
        mixed = [xp.exp(v) if k % 2 else v * values[k - 1] for k, v in enumerate(values)]
        red, green, blue = xp.dense((*mixed, wi[2]), layer(15, 3), layer(3))
        return red * red, xp.abs(green), values[3] * blue


@pytest.mark.parametrize("count", tiered([1, 15, 16, 200], [1, 200]))
def test_any_number_of_pairs(count: int) -> None:
    brdf, (wi, wo) = Uneven(), pairs(20_000)
    found = Gcc().run(header(brdf, "uneven"), "uneven", "eval", wi[:count], wo[:count])
    expected = brdf.eval(wi[:count].astype(float), wo[:count].astype(float))
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)


CALLS = """
#include "m.h"
void (*const calls_eval)(size_t, const float *, const float *, float *) = m_eval_n;
void (*const calls_pdf)(size_t, const float *, const float *, float *) = m_pdf_n;
void (*const calls_sample)(size_t, const float *, const float *, float *, float *) = m_sample_n;
"""


@pytest.mark.parametrize("name", tiered(["anisotropic", "physical", "scan"], ["anisotropic"]))
def test_every_loop_over_pairs_is_vectorized(name: str, tmp_path: Path) -> None:
    """Also where processors have no more than the vector instructions that all have."""
    version = subprocess.run(["gcc", "--version"], capture_output=True, text=True, check=True)
    if "Free Software Foundation" not in version.stdout:
        pytest.skip("gcc is not GCC, whose report this reads")
    files = header(material(name), "m")
    report = tmp_path / "report"
    command = ["gcc", "-std=c99", "-O3", f"-fopt-info-vec-optimized={report}", "-c", "-I."]
    build([*command, "-x", "c"], CALLS, files, tmp_path / "m.o")
    done = set(re.findall(r"m\.h:(\d+):.*loop vectorized", report.read_text()))
    lines = files["m.h"].decode().splitlines()
    loops = {
        str(k) for k, line in enumerate(lines, 1) if re.search(r"for .* l < (\d+ \* )?n;", line)
    }
    assert len(loops) >= 9
    assert loops <= done
