"""Radiance's XML: what is written and read, against Radiance's own library and rtrace."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.color import RADIANCE_PRIMARIES, rgb_to_xyz_matrix
from nacre.errors import FormatError
from nacre.geometry import from_spherical, join
from nacre.measured import radiance, tensor_tree
from tests.measured.support import hemisphere
from tests.specimens import SPECIMENS


class Shiny(nacre.Brdf):
    """A colored base under a broad highlight, reciprocal; with a bright one, more than is lit."""

    def __init__(self, gain: float = 1.0, isotropic: bool = True, gray: bool = False) -> None:
        super().__init__(name="shiny & <bright>")
        self.gain, self.isotropic = gain, isotropic
        self._base = (0.2, 0.2, 0.2) if gray else (0.3, 0.1, 0.02)

    def eval_components(self, wi, wo):
        x, y, z = (a + b for a, b in zip(wi, wo, strict=True))
        slope = (x * x + y * y * (1.0 if self.isotropic else 4.0)) / np.maximum(z * z, 1e-9)
        shine = self.gain * 0.5 * np.exp(-8.0 * slope)
        return tuple(color / math.pi + shine for color in self._base)


def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(4)
    return hemisphere(random, count), hemisphere(random, count)


def luminance(rgb: np.ndarray) -> np.ndarray:
    return np.asarray(rgb @ rgb_to_xyz_matrix(RADIANCE_PRIMARIES)[1])


@pytest.fixture(scope="module", params=[True, False], ids=["isotropic", "anisotropic"])
def written(request, tmp_path_factory) -> tuple[Path, Shiny]:
    path = tmp_path_factory.mktemp("radiance") / "shiny.xml"
    brdf = Shiny(isotropic=request.param)
    radiance.save(brdf, path, radiance.Resolution(32 if request.param else 8))
    return path, brdf


def test_radiances_library_reads_what_is_read_here(written) -> None:
    tools = pytest.importorskip("tests.measured.radiance_tools")
    path, _ = written
    wi, wo = pairs(200)
    expected = tools.luminances(path, wo, wi)
    # Its directions go through degrees: one in a hundred may lie in the next cube.
    found = luminance(nacre.load(path).eval(wi, wo))
    assert np.mean(np.abs(found / expected - 1.0) < 1e-3) > 0.99


def test_radiance_renders_what_is_read_here(written, tmp_path) -> None:
    """In color."""
    tools = pytest.importorskip("tests.measured.radiance_tools")
    path, brdf = written
    copy = tmp_path / "copy.xml"
    copy.write_bytes(path.read_bytes())
    wi, wo = (w[w[:, 2] > 0.5][:12] for w in pairs(60))
    found = tools.rendered(copy, wi, wo, tmp_path)
    np.testing.assert_allclose(found, nacre.load(path).eval(wi, wo), rtol=3e-3)
    expected = brdf.eval(wi, wo)
    assert np.abs(found - expected).mean() < (0.06 if brdf.isotropic else 0.3) * expected.mean()


def test_twice_the_cubes_halve_the_error(written, tmp_path) -> None:
    path, brdf = written
    radiance.save(brdf, tmp_path / "coarse.xml", radiance.Resolution(16 if brdf.isotropic else 4))
    wi, wo = pairs(4000)
    expected = brdf.eval(wi, wo)
    fine, coarse = (
        np.abs(nacre.load(file).eval(wi, wo) - expected).mean() / expected.mean()
        for file in (path, tmp_path / "coarse.xml")
    )
    assert fine < 0.65 * coarse
    assert fine < (0.1 if brdf.isotropic else 0.35)


def test_more_than_all_light_is_scaled_down(tmp_path) -> None:
    tools = pytest.importorskip("tests.measured.radiance_tools")
    path = tmp_path / "bright.xml"
    radiance.save(Shiny(20.0, gray=True), path, radiance.Resolution(16))
    reflected = tools.hemispherical(path, [0.1, 0.7, 1.3])
    assert ((reflected > 0.9) & (reflected < 1.0001)).all()
    dim = tmp_path / "dim.xml"
    radiance.save(Shiny(0.0, gray=True), dim, radiance.Resolution(4))
    np.testing.assert_allclose(tools.hemispherical(dim, [0.5]), 0.2, rtol=1e-3)


def test_a_grid_and_its_branches_are_one_function() -> None:
    """Radiance's own order: the first axis of a grid slowest, bit 0 of a branch the first axis."""
    grid = tensor_tree.parse("{0 1 2 3 4 5 6 7}", 3)
    tree = tensor_tree.parse("{{0}{4}{2}{6}{1}{5}{3}{7}}", 3)
    points = np.random.default_rng(0).random((3, 500))
    corner = (points > 0.5).astype(int)
    expected = 4 * corner[0] + 2 * corner[1] + corner[2]
    np.testing.assert_array_equal(grid.at(list(points)), expected)
    np.testing.assert_array_equal(tree.at(list(points)), expected)


def test_cubes_that_are_alike_become_one() -> None:
    values = np.ones((8, 8, 8))
    values[0, 0, 0] = 2.0
    text = tensor_tree.write(values, 0.01, 0.0, 4)
    back = tensor_tree.parse(text, 3)
    assert back.values.size == 8 + 7 + 7
    centers = (np.arange(8) + 0.5) / 8.0
    point = np.meshgrid(centers, centers, centers, indexing="ij")
    np.testing.assert_allclose(back.at(point), values)


def test_the_map_of_the_disk_keeps_areas() -> None:
    u, v = np.random.default_rng(1).random((2, 20000))
    x, y = tensor_tree.square_to_disk(u, v)
    np.testing.assert_allclose(tensor_tree.disk_to_square(x, y), (u, v), atol=1e-6)
    rings = np.histogram(x * x + y * y, 8, (0.0, 1.0))[0]
    np.testing.assert_allclose(rings, 2500, rtol=0.1)


def test_a_tree_is_evaluated_alike_in_other_libraries(written) -> None:
    torch = pytest.importorskip("torch")
    brdf = nacre.load(written[0])
    wi, wo = (w.astype(np.float32) for w in pairs(64))
    found = brdf.eval(torch.tensor(wi, requires_grad=True), torch.tensor(wo)).detach().numpy()
    np.testing.assert_allclose(found, brdf.eval(wi, wo), rtol=1e-4)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b"TensorTree3", b"Columns", "is not defined \\(known: lbnl/klems full"),
        (b"Reflection Back", b"Transmission Back", "holds no reflection, but Transmission Back"),
        (b"LBNL/Shirley-Chiu", b"LBNL/Klems Full", "AngleBasis 'LBNL/Klems Full'"),
        (b"Visible", b"Solar", "no reflection of visible light"),
        (b"{0.1}", b"{0.1 0.2}", "a leaf of 2 values, expected a power of 8"),
        (b"{0.1}", b"", "a node of 1 branches, expected 8"),
        (b"{0.1}", b"0.1", "values and branches in one node"),
        (b"{0.1}", b"{" * 20, "more than 12 levels"),
        (b"</Layer>", b"", "is not whole XML"),
        (b"<WindowElement>", b"<!DOCTYPE a><WindowElement>", "declares a document type"),
        (b"<Layer>", b"<Layer>" + b"<a>" * 80, "more than 64 elements within each other"),
        (b"<Layer>", b"<Layer>" + b"<a/>" * 70_000, "more than 65,536 elements"),
    ],
)
def test_what_is_not_read_is_refused_by_name(tmp_path, old, new, words) -> None:
    path = tmp_path / "paint.xml"
    path.write_bytes(SPECIMENS["Radiance BSDF"].files()[0].replace(old, new))
    with pytest.raises(FormatError, match=words):
        nacre.load(path)


def test_resolutions(tmp_path) -> None:
    with pytest.raises(ValueError, match="power of two"):
        radiance.Resolution(100)
    with pytest.raises(FormatError, match="up to 32 for an anisotropic"):
        radiance.save(Shiny(isotropic=False), tmp_path / "x.xml", radiance.Resolution(64))


def test_a_value_is_where_radiances_comments_put_it() -> None:
    grid = np.full((4, 4, 4), 0.1)
    grid[0, 3, 1] = 0.9  # sines of the view from 0.5 to 1; light from ahead, to the side
    text = "{" + " ".join(map(str, grid.ravel())) + "}"
    brdf = radiance.RadianceBrdf([tensor_tree.parse(text, 3)])
    wo = join(from_spherical(np.array(1.0), np.array(math.pi)))
    x, y = tensor_tree.square_to_disk(np.array(0.875), np.array(0.375))
    wi = np.array([x, y, math.sqrt(1.0 - x * x - y * y)])
    assert brdf.eval(wi, wo)[0] == pytest.approx(0.9)
    assert brdf.eval(wi * [-1.0, 1.0, 1.0], wo)[0] == pytest.approx(0.1)


def test_a_name_is_one_line_of_the_file(tmp_path) -> None:
    path = tmp_path / "a.xml"
    radiance.save(Shiny().replaced(name="red \n  paint <2>"), path, radiance.Resolution(8))
    assert "<Name>red paint &lt;2&gt;</Name>" in path.read_text("utf-8")


@pytest.mark.parametrize("gray", [False, True])
def test_facts_say_whether_there_is_color(tmp_path, gray) -> None:
    path = tmp_path / "a.xml"
    radiance.save(Shiny(gray=gray), path, radiance.Resolution(8))
    facts = nacre.load(path).describe()
    assert facts["color"] is not gray
    assert facts["tensor tree"].startswith("rank 3, ")
    low, high = facts["value range"]
    assert 0.0 <= low < 0.3 < high < 1.0
