"""Written RGL tables against their source, in our reader and in Mitsuba's `measured`."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.array import Components
from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.measured import MerlBrdf, RglBrdf, merl, rgl
from nacre.measured.rgl_writer import Resolution
from nacre.measured.tensor_file import read_tensors, write_tensors
from nacre.sampling.microfacets import NormalGrid, polar_nodes
from tests.reflectances import Beckmann, Glossy
from tests.tiers import tiered
from tests.variants import require_mitsuba

from ..data import list_data, require_data
from .support import assert_chi_square, hemisphere, material, relative_error, tensor_bytes, write

SMALL = Resolution(1, 12, 24, 24, 48)
SMALL_TURN = Resolution(13, 8, 16, 24, 32)
REAL = list_data("rgl", "*.bsdf") or ["satin_rosaline_rgb.bsdf"]


class Constant(Brdf):
    """One value whatever the directions."""

    def __init__(self, value: float) -> None:
        self.value = value

    def eval_components(self, wi: Components, wo: Components) -> Components:
        f = self.value + 0.0 * wi[2] * wo[2]
        return f, f, f


class Horizontal(Brdf):
    """f_r cos is 1 / pi up to the horizon."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        f = 1.0 / (math.pi * wi[2]) + 0.0 * wo[2]
        return f, f, f


def pairs(count: int = 20_000) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    rng = np.random.default_rng(3)
    return hemisphere(rng, count), hemisphere(rng, count)


MATERIALS = {
    "diffuse": (Glossy(0.5, 0.0, 0.5), 0.001, 0.03),
    "glossy": (Glossy(0.2, 0.05, 0.3), 0.001, 0.03),
    "sharp": (Glossy(0.1, 0.5, 0.03), 0.002, 0.06),
    "anisotropic": (Glossy(0.1, 0.3, 0.15, 0.5), 0.01, 0.11),
    "metal": (Beckmann(0.0, 1.0, 0.05, 0.3), 0.001, 0.15),
}


@pytest.fixture(scope="module", params=tiered(MATERIALS, ["metal", "anisotropic"]))
def written(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Brdf, float, float, Path]:
    brdf, median, high = MATERIALS[request.param]
    path = tmp_path_factory.mktemp("rgl") / "made_rgb.bsdf"
    nacre.save(brdf, path)
    return brdf, median, high, path


def test_a_table_evaluates_like_its_source(written: tuple[Brdf, float, float, Path]) -> None:
    brdf, median, high, path = written
    table = nacre.load(path)
    assert isinstance(table, RglBrdf)
    assert table.isotropic == brdf.isotropic
    wi, wo = pairs()
    truth = brdf.eval(wi, wo) * wi[:, 2:]
    error = relative_error(table.eval(wi, wo) * wi[:, 2:], truth)
    assert np.median(error) < median
    assert np.quantile(error, 0.95) < high
    lit = truth[:, 0] > 1e-6
    assert table.valid(wi, wo)[lit].mean() > 0.99


def test_mitsuba_evaluates_a_table_like_its_source(
    written: tuple[Brdf, float, float, Path],
) -> None:
    brdf, median, high, path = written
    mi = require_mitsuba()
    import drjit as dr

    wi, wo = pairs()
    theirs = mi.load_dict({"type": "measured", "filename": str(path)})
    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.wi = mi.Vector3f(np.ascontiguousarray(wo.T))
    value = np.array(theirs.eval(mi.BSDFContext(), si, mi.Vector3f(np.ascontiguousarray(wi.T)))).T
    error = relative_error(value, brdf.eval(wi, wo) * wi[:, 2:])
    assert np.median(error) < median
    assert np.quantile(error, 0.95) < high
    assert value.min() > -1e-5
    density = np.array(theirs.pdf(mi.BSDFContext(), si, mi.Vector3f(np.ascontiguousarray(wi.T))))
    ours = nacre.load(path).pdf(wi, wo)
    assert np.quantile(relative_error(ours, density), 0.99) < 1e-3


def test_no_value_of_a_table_is_negative(written: tuple[Brdf, float, float, Path]) -> None:
    """Mitsuba's `measured` clamps none: it would reflect negative light at the horizon."""
    tensors = read_tensors(written[3])
    assert tensors["rgb"].min() >= 0.0


def test_a_table_samples_what_it_reflects(written: tuple[Brdf, float, float, Path]) -> None:
    brdf, _, _, path = written
    table = nacre.load(path)
    _, wo = pairs()
    wi, pdf = table.sample(wo, np.random.default_rng(4).random((len(wo), 3)))
    drawn = pdf > 0.0
    assert drawn.mean() > 0.8
    again = table.pdf(wi[drawn], wo[drawn])
    assert np.quantile(np.abs(again - pdf[drawn]) / pdf[drawn], 0.99) < 0.02
    steep = wo[drawn, 2] > 0.3
    reflected = brdf.eval(wi[drawn], wo[drawn])[:, 0] * wi[drawn, 2] / pdf[drawn]
    weights = reflected[steep] / reflected[steep].mean()
    assert weights.std() < 0.5, "samples go where the light comes from"


@pytest.mark.parametrize("rough", [(0.15, 0.5), pytest.param((0.05, 0.3), marks=pytest.mark.slow)])
def test_a_highlight_without_a_diffuse_part_has_no_halo(rough: tuple[float, float]) -> None:
    metal = Beckmann(0.0, 1.0, *rough)
    table = rgl.tabulate(metal)
    wi, wo = pairs()
    truth = metal.eval(wi, wo)[:, 0] * wi[:, 2]
    dark = (truth < 1e-3) & (wi[:, 2] > 0.1) & (wo[:, 2] > 0.1)
    leaked = table.eval(wi, wo)[dark, 0] * wi[dark, 2] - truth[dark]
    assert dark.mean() > 0.4
    assert leaked.mean() < 1e-4
    assert np.quantile(leaked, 0.99) < 2e-3
    for light in nacre.metrics.compare(metal, table, size=48, directions=64).lights:
        assert light.errors.psnr > 40.0


def test_the_normals_of_a_microfacet_material_are_found() -> None:
    brdf = Glossy(0.0, 1.0, 0.25)
    found = NormalGrid(64, 128, isotropic=True).density(brdf)[0]
    theta = polar_nodes(128)
    true = brdf.distribution((np.sin(theta), 0.0 * theta, np.cos(theta)))
    steep = theta < 1.0
    np.testing.assert_allclose(found[steep], true[steep], rtol=0.05)


def test_the_projected_area_of_flat_and_uniform_normals() -> None:
    grid = NormalGrid(64, 128, isotropic=True)
    uniform = grid.projected_area(np.ones(grid.shape))
    np.testing.assert_allclose(uniform[0, 0], math.pi, rtol=1e-3)
    np.testing.assert_allclose(uniform[0, -1], 0.5 * math.pi, rtol=2e-2)
    assert (uniform == uniform[0]).all()


@pytest.mark.parametrize("name", REAL)
def test_a_real_table_comes_back_bit_for_bit(name: str, tmp_path: Path) -> None:
    path = require_data("rgl", name)
    nacre.save(nacre.load(path), tmp_path / name)
    one, other = read_tensors(path), read_tensors(tmp_path / name)
    assert one.keys() == other.keys()
    for field, values in one.items():
        assert values.dtype == other[field].dtype
        np.testing.assert_array_equal(values, other[field])


def test_what_was_written_is_written_again_byte_for_byte(tmp_path: Path) -> None:
    first, second = tmp_path / "a.bsdf", tmp_path / "b.bsdf"
    rgl.save(Glossy(0.2, 0.05, 0.3), first, SMALL)
    nacre.save(nacre.load(first), second)
    assert first.read_bytes() == second.read_bytes()


def test_tensors_of_every_type_come_back(tmp_path: Path) -> None:
    types = ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", ">f4", "f8")
    fields = {f"t{k}": np.arange(6).astype(t).reshape(2, 3) for k, t in enumerate(types)}
    write_tensors(fields, tmp_path / "t.bsdf")
    back = read_tensors(tmp_path / "t.bsdf")
    assert list(back) == list(fields)
    for name, values in fields.items():
        np.testing.assert_array_equal(back[name], values)
    little = {name: v for name, v in fields.items() if not v.dtype.str.startswith(">")}
    write_tensors(little, tmp_path / "t.bsdf")
    assert (tmp_path / "t.bsdf").read_bytes().startswith(tensor_bytes(little))


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, 1e30])
def test_a_wild_material_makes_a_table_that_loads(tmp_path: Path, value: float) -> None:
    path = tmp_path / "wild.bsdf"
    rgl.save(Constant(value), path, SMALL)
    table = nacre.load(path)
    wi, wo = pairs(2000)
    f_r = table.eval(wi, wo)
    assert np.isfinite(f_r).all()
    known = not math.isnan(value)
    assert table.valid(wi, wo).mean() > 0.99 if known else not table.valid(wi, wo).any()
    if value <= 0.0 or not known:
        assert f_r.max() < 1e-6
    _, pdf = table.sample(wo, np.random.default_rng(1).random((2000, 3)))
    assert np.isfinite(pdf).all()
    assert (pdf > 0.0).mean() > 0.6


def test_samples_of_a_table_follow_its_density() -> None:
    for brdf, nodes in ((Glossy(0.3, 0.05, 0.4), SMALL), (Glossy(0.3, 0.1, 0.3, 0.6), SMALL_TURN)):
        assert_chi_square(rgl.tabulate(brdf, nodes), [0.3, -0.4])


@pytest.mark.parametrize(
    "name", tiered(["chrome.h5", "blue-acrylic.h5", "pink-fabric.h5"], ["chrome.h5"])
)
def test_a_sphere_of_a_table_looks_like_its_source(name: str) -> None:
    network = nacre.load(require_data("pretrained", "merl", name))
    comparison = nacre.metrics.compare(network, rgl.tabulate(network), size=48, directions=64)
    for light in comparison.lights:
        assert light.errors.psnr > 45.0


@pytest.mark.parametrize(
    "name",
    tiered(["chrome.h5", "pink-fabric.h5", "specular-black-phenolic.h5"], ["pink-fabric.h5"]),
)
def test_a_published_network_becomes_a_table(name: str, tmp_path: Path) -> None:
    network = nacre.load(require_data("pretrained", "merl", name))
    nacre.save(network, tmp_path / "x.bsdf")
    table = nacre.load(tmp_path / "x.bsdf")
    assert table.name == network.name
    wi, wo = pairs()
    error = relative_error(table.eval(wi, wo) * wi[:, 2:], network.eval(wi, wo) * wi[:, 2:])
    assert np.median(error) < 0.02
    assert np.quantile(error, 0.95) < (0.4 if name == "chrome.h5" else 0.1)


def test_unknown_samples_of_a_merl_table_stay_unknown(tmp_path: Path) -> None:
    stored = np.array(merl.tabulate(Glossy(0.5, 0.0, 0.5)).stored)
    stored[:, :, 60:] = merl.INVALID  # nothing known from 60 degrees between light and half vector
    source = MerlBrdf(stored)
    table = rgl.tabulate(source, SMALL)
    wi, wo = pairs()
    angle = np.arccos(np.clip(np.sum(wi * wo, -1), -1.0, 1.0)) / 2.0
    assert table.valid(wi, wo)[angle < math.radians(50)].mean() > 0.99
    assert table.valid(wi, wo)[angle > math.radians(70)].mean() < 0.2


@pytest.mark.parametrize(
    ("end", "reduction"),
    tiered([(-0.5 * np.pi, 4), (0.0, 2), (np.pi, 1)], [(-0.5 * np.pi, 4)]),
)
def test_tables_of_every_symmetry_are_tabulated_anew(
    tmp_path: Path, end: float, reduction: int
) -> None:
    path = write(tmp_path / "part.bsdf", tensor_bytes(material(np.linspace(-np.pi, end, 8))))
    source = nacre.load(path)
    table = RglBrdf(rgl.tabulate(source, SMALL_TURN).tables)
    assert not table.isotropic
    assert table.tables.reduction == reduction
    wi, wo = pairs()
    error = relative_error(table.eval(wi, wo) * wi[:, 2:], source.eval(wi, wo) * wi[:, 2:])
    assert np.median(error) < 0.2, "random tables, few nodes"


def test_light_at_the_horizon_is_kept() -> None:
    """Real tables hold f_r cos that does not vanish there."""
    source = Horizontal()
    table = rgl.tabulate(source)
    wi, wo = pairs()
    low = (wi[:, 2] < 0.05) & (wo[:, 2] > 0.1)
    assert low.sum() > 500
    error = np.abs(table.eval(wi, wo)[low] / source.eval(wi, wo)[low] - 1.0)
    assert np.median(error) < 0.03
    assert np.quantile(error, 0.95) < 0.3


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ((0, 12, 24, 24, 48), "2 or more"),
        ((1, 1, 24, 24, 48), "2 or more"),
        ((1, 12, 1, 24, 48), "2 or more"),
        ((1, 12, 24, -5, 48), "2 or more"),
        ((1, 12, 24, 128, 128), "at most 8192"),
        ((1, 12, 10**6, 24, 48), "numbers"),
        ((10**9, 12, 24, 24, 48), "numbers"),
    ],
)
def test_resolutions_that_cannot_be_kept_are_refused(nodes: tuple[int, ...], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Resolution(*nodes)


def test_an_anisotropic_material_needs_azimuths(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="at least 4 phi_i"):
        rgl.save(Glossy(0.5, 0.5, 0.1, 0.3), tmp_path / "x.bsdf", SMALL)
    assert not list(tmp_path.iterdir())


def test_a_table_is_tabulated_anew_at_a_resolution(tmp_path: Path) -> None:
    table = rgl.tabulate(Glossy(0.5, 0.0, 0.5), SMALL)
    rgl.save(table, tmp_path / "x.bsdf", Resolution(1, 6, 10, 8, 16))
    assert rgl.load(tmp_path / "x.bsdf").tables.rgb.shape == (1, 6, 3, 10, 10)
