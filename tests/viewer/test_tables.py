"""Tables in the page against nacre's own: packed by Python, and read by the page from files."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.formats import load_brdf
from nacre.geometry import split
from nacre.measured.merl import load as load_merl
from nacre.mitsuba.studio import studio
from nacre.viewer.content import Content, Entry
from nacre.viewer.tables import SAMPLER, halves
from tests.contracts.materials import made
from tests.data import require_data
from tests.measured.support import hemisphere, material, tensor_bytes
from tests.specimens.tables import mbsdf_file
from tests.tiers import tiered
from tests.viewer.tab import Tab, page
from tests.viewer.test_pictures import MAP_SIZE, environment, integrated, rendered

AZIMUTHS = {
    "isotropic": (0.0,),
    "two-azimuths": (-1.0, 1.0),
    "full-turn": np.linspace(-math.pi, math.pi, 9),
    "half-turn": np.linspace(-math.pi, 0.0, 6),
    "quarter-turn": np.linspace(-math.pi, -math.pi / 2.0, 5),
}


def merl_file(kind: str) -> bytes:
    """A small table with a few samples missing, some of them neighbors."""
    counts = np.array([9, 7, 12], "<i4")
    values = np.random.default_rng(3).gamma(0.5, 300.0, (3, *counts)).astype(kind)
    values[1, 2:4, 3, 5:8] = -1.0
    values[:, 0, 0, :6] = -1.0
    return counts.tobytes() + values.tobytes()


FILES: dict[str, bytes] = {
    **{f"merl-{kind}.binary": merl_file(f"<{kind}") for kind in ("f8", "f4", "f2")},
    "gray.mbsdf": mbsdf_file(4, 5, 1, b"a line\n", value=-0.25),
    "color.mbsdf": mbsdf_file(5, 6),
    "one.mbsdf": mbsdf_file(1, 1),
    **{f"{name}.bsdf": tensor_bytes(material(phi)) for name, phi in AZIMUTHS.items()},
    "plain.bsdf": tensor_bytes(material((0.0,)) | {"jacobian": np.zeros(1, np.uint8)}),
}
MEASURED = ("rgl", "cg_sunflower_rgb.bsdf"), ("mbsdf", "carpaint_blue.mbsdf")
NEAREST = "nearest"
FEW = "merl-f4.binary", "color.mbsdf", "isotropic.bsdf", "half-turn.bsdf"
"""Of the files, for the first tier."""

WITHOUT_PICTURES = """() => {
  const { page } = window;
  page.drop.add = ({ name, table }) => page.materials.list.push({ name, forms: [{ table }] });
  page.loop = () => {};
}"""
VALUES = """([k, wi, wo]) => {
  const { materials, renderer } = window.page;
  const shown = materials.shown(materials.list[k].forms[0]);
  return [...renderer.values(shown, Float32Array.from(wi), Float32Array.from(wo))];
}"""
GRIDS = """(k) => {
  const { materials } = window.page, { table } = materials.list[k].forms[0];
  const whole = materials.whole(table), { grids, ...facts } = whole;
  const said = ({ size, channels, values }) => [size, channels, window.encoded(values)];
  return [facts, Object.fromEntries(Object.entries(grids).map(([name, x]) => [name, said(x)]))];
}"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("tables")
    for name, content in FILES.items():
        (made / name).write_bytes(content)
    return made


@pytest.fixture(scope="module")
def tab(chromium: Any, folder: Path) -> Iterator[Tab]:
    """A page with every table packed, and onto which every file was then brought."""
    names = [*FILES, *(name for _, name in MEASURED)]
    entries = [Entry(name, {"Measured": table(folder, name)}) for name in names]
    entries.append(Entry(NEAREST, {"Measured": load_merl(folder / "merl-f8.binary", NEAREST)}))
    with mock.patch("nacre.viewer.content._THUMBNAIL", 4):  # they would take most of the time
        content = page("Tables", entries, [studio(MAP_SIZE[1])])
    with Tab(chromium, folder) as opened:
        opened.open(content)
        opened.page.evaluate(WITHOUT_PICTURES)
        paths = [path(folder, name) for name in names]
        opened.page.locator("input[type=file]").set_input_files(paths)
        opened.wait(f"window.page.materials.list.length === {len(entries) + len(names)}")
        assert not opened.page.locator("#trouble").text_content()
        yield opened


def path(folder: Path, name: str) -> Path:
    real = {end: parent for parent, end in MEASURED}
    return require_data(real[name], name) if name in real else folder / name


def table(folder: Path, name: str) -> Brdf:
    return load_brdf(path(folder, name))


def pairs(count: int = 600) -> tuple[Floats, Floats]:
    """Pairs of directions, a third of them around the normal and a third mirrored nearly."""
    random = np.random.default_rng(1)
    wi, wo = hemisphere(random, count), hemisphere(random, count)
    wi[: count // 3, :2] *= 0.05
    wo[count // 6 : count // 3, :2] *= 0.05
    mirrored = slice(count // 3, 2 * count // 3)
    wo[mirrored] = wi[mirrored] * np.float32([-1, -1, 1])
    wo[mirrored] += 0.1 * random.normal(size=wo[mirrored].shape)
    wo[:, 2] = np.abs(wo[:, 2]) + 1e-3
    for w in (wi, wo):
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    return wi, wo


def values(tab: Tab, index: int) -> Floats:
    wi, wo = (w.ravel().tolist() for w in pairs())
    return np.reshape(tab.page.evaluate(VALUES, [index, wi, wo]), (-1, 4))


@pytest.mark.parametrize(
    "name",
    tiered([*FILES, *(name for _, name in MEASURED), NEAREST], {*FEW, MEASURED[0][1], NEAREST}),
)
def test_values_are_those_of_nacre(tab: Tab, folder: Path, name: str) -> None:
    names = tab.page.evaluate("window.page.materials.list.map((each) => each.name)")
    brdf = load_merl(folder / "merl-f8.binary", NEAREST) if name == NEAREST else table(folder, name)
    index = names.index(name)
    wi, wo = pairs()
    found, wanted = values(tab, index), brdf.eval(wi, wo)
    density = SAMPLER.pdf_components(split(wi), split(wo))
    close = np.isclose(found[:, :3], wanted, rtol=5e-4, atol=1e-3 * min(1.0, wanted.max()))
    # Where a value jumps, two roundings may fall on either side.
    assert close.all() or (name == NEAREST and close.mean() > 0.99)
    np.testing.assert_allclose(found[:, 3], density, rtol=2e-3, atol=1e-5)


@pytest.mark.parametrize(
    "name", tiered([*FILES, *(name for _, name in MEASURED)], {*FEW, MEASURED[0][1]})
)
def test_a_file_gives_the_table_that_is_packed_of_it(tab: Tab, name: str) -> None:
    at = [*FILES, *(name for _, name in MEASURED)].index(name)
    first, second = (tab.page.evaluate(GRIDS, k) for k in (at, at + len(FILES) + 3))
    assert first == second


def test_patches_agree_with_integration(tab: Tab, folder: Path) -> None:
    name = "gray.mbsdf"
    brdf, index = table(folder, name), list(FILES).index(name)
    sums, normals, tangents, _ = rendered(tab, index, 0)
    lighting = environment(tab)
    rows, columns = np.nonzero(normals[..., 2] > 0.3)
    found, wanted = [], []
    for at in np.random.default_rng(0).choice(len(rows), 12, replace=False):
        pixel = rows[at], columns[at]
        n, t = (np.float64(axes[pixel][:3]) for axes in (normals, tangents))
        wanted.append(integrated(brdf, lighting, np.stack([t, np.cross(n, t), n], 1)))
        found.append(sums[pixel][:3] / sums[pixel][3])
    difference = np.array(found) - np.array(wanted)
    error = difference.std(axis=0, ddof=1) / math.sqrt(len(found))
    assert (error < 0.02 * np.mean(wanted, axis=0)).all()
    assert (np.abs(difference.mean(axis=0)) < 4.5 * error).all()


def test_halves_are_those_of_numpy() -> None:
    random = np.random.default_rng(0)
    for largest in (1e-30, 0.3, 65504.0, 65505.0, 3e38):
        numbers = np.float32(largest * random.random(100) ** 4)
        scale, found = halves(numbers)
        assert math.log2(scale).is_integer()
        np.testing.assert_allclose(found * np.float64(scale), numbers, rtol=5e-4, atol=scale * 6e-8)
        assert np.isfinite(found).all()
    assert halves(np.zeros(3, np.float32))[0] == 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("isotropic scattered samples", "merl"),
        ("polarized table", "merl"),
        ("Klems matrix", "rgl"),
    ],
)
def test_what_has_no_formula_becomes_a_table(name: str, kind: str) -> None:
    content = Content([studio()])
    with mock.patch("nacre.viewer.content._THUMBNAIL", 4):
        content.add(Entry(name, {"Measured": made(name)}))
    (material,) = content.facts["materials"]
    assert material["forms"][0]["table"]["kind"] == kind
