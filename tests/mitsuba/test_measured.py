"""RGL tables that nacre wrote, in Mitsuba's own plugin `measured` and in nacre's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
import nacre.mitsuba
from nacre.array import Components
from nacre.brdf import Brdf
from nacre.errors import require
from nacre.geometry import half_vector
from nacre.measured import RglBrdf, rgl
from nacre.measured.rgl_writer import ISOTROPIC, Resolution
from tests.measured.support import hemisphere, relative_error
from tests.reflectances import Glossy, Rotated
from tests.tiers import tiered

from .chi_square import chi_square
from .reflectances import interaction


class Slanted(Glossy):
    """Brighter where the half vector leans to +x."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        h = half_vector(wi, wo)
        red, green, blue = super().eval_components(wi, wo)
        scale = 1.0 + 0.5 * h[0]
        return red * scale, green * scale, blue * scale


SMALL = Resolution(25, 12, 32, 32, 48)
SOURCES: dict[str, tuple[Brdf, int, Resolution]] = {
    "smooth": (Glossy(0.2, 0.05, 0.3), 1, ISOTROPIC),
    "sharp": (Glossy(0.1, 0.5, 0.03), 1, ISOTROPIC),
    "anisotropic": (Glossy(0.1, 0.3, 0.05, 0.2), 4, SMALL),
    "turned": (Rotated(0.1, 0.3, 0.15, 0.5), 2, SMALL),
    "slanted": (Slanted(0.1, 0.3, 0.15, 0.5), 1, SMALL),
}
"""What is written, its symmetry, and how finely."""


@pytest.fixture(scope="module", params=tiered(SOURCES, list(SOURCES)[::2]))
def written(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("written") / f"{request.param}.bsdf"
    brdf, _, resolution = SOURCES[request.param]
    rgl.save(brdf, path, resolution)
    return path


def both(mi: Any, path: Path) -> tuple[Any, Any]:
    """The file in Mitsuba's plugin and in nacre's."""
    theirs = mi.load_dict({"type": "measured", "filename": str(path)})
    return theirs, nacre.mitsuba.bsdf(nacre.load(path))


@pytest.mark.parametrize("degrees", tiered([30.0, 75.0], [75.0]))
def test01_samples_follow_the_density(rgb: Any, written: Path, degrees: float) -> None:
    for bsdf in both(rgb, written):
        test = chi_square(rgb, bsdf, degrees, steps=16)
        assert test.run(test_count=4 * len(SOURCES), quiet=True), test.messages


def test02_both_plugins_agree(rgb: Any, written: Path) -> None:
    dr = require("drjit", "render")
    table = nacre.load(written)
    assert isinstance(table, RglBrdf)
    random = np.random.default_rng(5)
    wi, wo = hemisphere(random, 20_000), hemisphere(random, 20_000)
    context, si = rgb.BSDFContext(), interaction(rgb, wo)
    light = rgb.Vector3f(np.ascontiguousarray(wi.T))
    theirs, ours = (bsdf.eval_pdf(context, si, light) for bsdf in both(rgb, written))
    dr.eval(theirs, ours)  # as one kernel
    value = relative_error(np.array(ours[0]).T, np.maximum(np.array(theirs[0]).T, 0.0))
    density = relative_error(np.array(ours[1]), np.array(theirs[1]))
    for error in (value, density):
        assert np.quantile(error, 0.999) < 1e-3
    assert (np.array(theirs[0]) < 0.0).mean() < 1e-2


def test03_weights_are_eval_over_pdf(rgb: Any, written: Path) -> None:
    dr, random = require("drjit", "render"), np.random.default_rng(6)
    context, si = rgb.BSDFContext(), interaction(rgb, hemisphere(random, 20_000))
    u = random.random((2, 20_000)).astype(np.float32)
    for bsdf in both(rgb, written):
        sample, weight = bsdf.sample(context, si, rgb.Float(0.5), rgb.Point2f(u))
        value, pdf = bsdf.eval_pdf(context, si, sample.wo)
        dr.eval(sample, weight, value, pdf)
        lit = np.array(sample.wo)[2] > 1e-2
        assert lit.mean() > 0.7
        error = relative_error(np.array(weight * sample.pdf).T[lit], np.array(value).T[lit])
        assert np.quantile(error, 0.99) < 2e-2
        assert np.quantile(relative_error(np.array(sample.pdf), np.array(pdf))[lit], 0.99) < 2e-2


def test04_azimuths_span_what_the_symmetry_leaves(written: Path) -> None:
    brdf, reduction, _ = SOURCES[written.stem]
    table = nacre.load(written)
    assert isinstance(table, RglBrdf)
    assert table.tables.reduction == reduction
    random = np.random.default_rng(7)
    wi, wo = hemisphere(random, 20_000), hemisphere(random, 20_000)
    error = relative_error(table.eval(wi, wo) * wi[:, 2:], brdf.eval(wi, wo) * wi[:, 2:])
    assert np.median(error) < 0.02
