"""The map of a page, and what it decodes and saves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic import AnisotropicGgx, Ggx
from nacre.latent.file import pretrained_hypernetwork
from nacre.mitsuba.environment import Environment
from nacre.neural.nbrdf import NeuralBrdf
from nacre.numerics.mlp import flat_weights
from nacre.sampling import describe_sampler
from nacre.viewer.content import Content, Entry
from nacre.viewer.space import add_space, decoded, places
from tests.viewer.tab import Tab

COUNT = 7
GRAY = {"diffuse": (0.2, 0.2, 0.2), "specular": (0.3, 0.3, 0.3)}
PLAIN = Ggx(**GRAY, roughness=0.3)
BRUSHED = AnisotropicGgx(**GRAY, roughness_x=0.2, roughness_y=0.4, angle=0.0)


def sky() -> Environment:
    return replace(Environment(np.ones((16, 32, 3), np.float32)), name="sky")


def materials() -> list[Entry]:
    """Networks of the basis's own training codes, the anisotropic one second."""
    basis = pretrained_hypernetwork()
    examples = basis.basis.examples[:: 120 // COUNT][:COUNT]
    found = [
        Entry(f"made {k}", {"Network": decoded(basis, code, f"made {k}")})
        for k, code in enumerate(examples)
    ]
    return [found[0], Entry("brushed", {"Formula": BRUSHED, "Plain": PLAIN}), *found[1:]]


@pytest.fixture(scope="module")
def content() -> Content:
    pytest.importorskip("openTSNE")
    made, entries = Content([sky()]), materials()
    for entry in entries:
        made.add(entry)
    assert add_space(made, entries) == COUNT
    return made


@pytest.fixture(scope="module")
def space(
    chromium: Any, content: Content, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Tab]:
    with Tab(chromium, tmp_path_factory.mktemp("space")) as tab:
        tab.open(content.page("Space"))
        tab.page.evaluate("window.page.renderer.resize(64, 64)")  # software draws it
        tab.page.click("#tab-space")
        yield tab


def at(tab: Tab, place: list[float]) -> dict[str, Any]:
    """What the page decodes at a place of the map."""
    found: dict[str, Any] = tab.page.evaluate(
        """(place) => {
            const { mode } = window.page;
            mode.go(place);
            mode.decode();
            const tensors = Object.values(mode.file.tensors).flatMap(({ values }) => [...values]);
            const { header } = mode.file, { tensors: { codes, places } } = mode.decoder;
            return {
                weights: mode.weights, tensors, sampler: header.sampler, code: header.source.code,
                codes: [...codes.values], places: [...places.values],
            };
        }""",
        place,
    )
    return found


def mixed(found: dict[str, Any], place: list[float]) -> np.ndarray:
    """The code of a place by Franke and Little's weights, from the page's codes and places."""
    codes = np.array(found["codes"], np.float64).reshape(COUNT, -1)
    where = np.array(found["places"], np.float64).reshape(COUNT, 2)
    distance = np.linalg.norm(where - place, axis=1)
    reach = np.sort(distance)[6]
    parts = np.maximum(1.0 / distance - 1.0 / reach, 0.0) ** 2
    return parts / parts.sum() @ codes


PLACES = [[0.5, 0.5], [0.2, 0.7], [0.93, 0.11], [0.0, 1.0]]


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
def test_a_place_is_decoded_as_nacre_decodes_it(space, place):
    basis, found = pretrained_hypernetwork(), at(space, place)
    np.testing.assert_allclose(found["code"], mixed(found, place), rtol=1e-5, atol=1e-6)
    network = decoded(basis, found["code"])
    ours, theirs = (
        np.array(a, np.float32) for a in (found["tensors"], flat_weights(network.layers))
    )
    # Both add in double precision, in another order, and round to single.
    assert (np.abs(ours - theirs) <= np.spacing(np.abs(theirs))).all()
    assert (ours == theirs).mean() > 0.99
    expected = describe_sampler(network.sampler)
    assert found["sampler"].keys() == expected.keys()
    for key in ("uniform", "squared", "cosines"):
        np.testing.assert_allclose(found["sampler"][key], expected[key], atol=2e-4)
    for lobe, known in zip(found["sampler"]["lobes"], expected["lobes"], strict=True):
        for key in known:
            np.testing.assert_allclose(lobe[key], known[key], rtol=2e-3, atol=2e-4)


def test_a_material_of_the_map_is_its_own_code(space, content):
    space.page.evaluate("window.page.choose(3)")
    found = at(space, space.page.evaluate("window.page.mode.place"))
    assert found["weights"] == [[2, 1]]  # the second entry is not on the map
    basis = pretrained_hypernetwork()
    expected = basis.encode(materials()[3].forms["Network"])
    np.testing.assert_allclose(found["code"], expected, atol=1e-6)
    assert content.facts["space"]["materials"] == [0, *range(2, COUNT + 1)]


def test_weights_do_not_jump(space):
    steps = space.page.evaluate(
        """() => {
            const { mode } = window.page, found = [];
            for (let k = 0; k <= 2000; k++) {
                mode.go([k / 2000, 0.35 + 0.0002 * k / 2000]);
                const row = new Array(mode.places.length).fill(0);
                mode.weights.forEach(([index, weight]) => (row[index] = weight));
                found.push(row);
            }
            return found;
        }"""
    )
    weights = np.array(steps)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-9)
    assert np.abs(np.diff(weights, axis=0)).max() < 0.02


@pytest.mark.slow
def test_a_saved_material_is_the_one_shown(space, tmp_path):
    found = at(space, [0.4, 0.6])
    rng = np.random.default_rng(0)
    pairs = rng.normal(size=(2, 400, 3))
    pairs[..., 2] = np.abs(pairs[..., 2]) + 0.02
    wi, wo = (pairs / np.linalg.norm(pairs, axis=-1, keepdims=True)).astype(np.float32)
    shown = space.page.evaluate(
        """([wi, wo]) => {
            const { mode, materials, renderer } = window.page;
            const directions = [wi, wo].map((values) => Float32Array.from(values));
            const both = [mode.material, materials.varying(mode.file)];
            return both.map((material) => [...renderer.values(material, ...directions)]);
        }""",
        [wi.ravel().tolist(), wo.ravel().tolist()],
    )
    with space.page.expect_download() as waiting:
        space.page.click("text=Save this material")
    path = tmp_path / waiting.value.suggested_filename
    waiting.value.save_as(path)
    assert path.suffix == ".safetensors"
    loaded = nacre.load(path)
    assert isinstance(loaded, NeuralBrdf)
    tensors = np.array(found["tensors"], np.float32)
    np.testing.assert_array_equal(flat_weights(loaded.layers), tensors)
    assert describe_sampler(loaded.sampler)["lobes"][0]["share"] == tuple(
        found["sampler"]["lobes"][0]["share"]
    )
    for values in np.array(shown).reshape(2, -1, 4):
        np.testing.assert_allclose(values[:, :3], loaded.eval(wi, wo), rtol=5e-4, atol=1e-3)
        pdf = loaded.pdf(wi, wo)
        np.testing.assert_allclose(values[:, 3], pdf, rtol=2e-3, atol=1e-3)
    nacre.save(loaded, tmp_path / "again.safetensors")
    again = nacre.load(tmp_path / "again.safetensors")
    np.testing.assert_array_equal(flat_weights(again.layers), tensors)
    assert again.name == loaded.name


@pytest.mark.slow
def test_keys_move_the_marker_and_the_shelf_takes_the_material(space):
    page = space.page
    at(space, [0.5, 0.5])
    page.focus(".marker")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowUp")
    np.testing.assert_allclose(page.evaluate("window.page.mode.place"), [0.52, 0.48])
    before = page.locator(".material").count()
    page.click("text=Put it on the shelf")
    assert page.locator(".material").count() == before + 1
    assert page.evaluate("window.page.chosen.group") == "From the map"
    page.click("#tab-look")
    space.wait("window.page.renderer.frames > 0")


def test_a_click_on_a_sphere_chooses_it_and_a_drag_moves_between(space):
    page = space.page
    page.click("#tab-space")
    page.locator(".map .sphere").nth(4).click()
    assert page.evaluate("window.page.shelf.selected") == 5
    box = page.locator(".map").bounding_box()
    page.mouse.move(box["x"] + 3, box["y"] + 3)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.25 * box["height"])
    page.mouse.up()
    np.testing.assert_allclose(page.evaluate("window.page.mode.place"), [0.5, 0.25], atol=0.01)
    space.keep("space")


@pytest.mark.slow
def test_the_map_stays_under_the_pointer(space):
    page, chart = space.page, space.page.locator(".map")
    page.click("#tab-space")
    page.locator(".material").nth(1).click()
    assert page.locator("#forms button").count() == 2  # which no place of the map has
    box, names = chart.bounding_box(), set()
    page.mouse.move(box["x"] + 3, box["y"] + 3)
    page.mouse.down()
    for part in (0.3, 0.6, 0.9):
        page.mouse.move(box["x"] + part * box["width"], box["y"] + 0.25 * box["height"])
        space.wait("!window.page.mode.old")  # decoded, and said by name
        names.add(page.locator("#name").inner_text())
        assert chart.bounding_box() == box
        place = page.evaluate("window.page.mode.place")
        np.testing.assert_allclose(place, [part, 0.25], atol=0.01)
    page.mouse.up()
    assert len(names) == 3


@pytest.mark.slow
def test_a_page_of_few_materials_has_no_map(tab):
    entries = [Entry("one", {"Formula": PLAIN}), Entry("two", {"Formula": BRUSHED})]
    content = Content([sky()])
    for entry in entries:
        content.add(entry)
    assert add_space(content, entries) == 0
    assert "space" not in content.facts
    tab.open(content.page("Few"))
    assert tab.page.locator("#tab-space").count() == 0


def test_places_fill_the_map_and_lie_apart():
    pytest.importorskip("openTSNE")
    codes = np.random.default_rng(0).normal(size=(40, 8))
    found = places(codes)
    assert found.min() > 0.0
    assert found.max() < 1.0
    assert (np.ptp(found, axis=0) > 0.7).all()
    apart = np.abs(found[:, None] - found).max(axis=2) + np.eye(40)
    assert apart.min() > 0.08
    np.testing.assert_array_equal(found, places(codes))
