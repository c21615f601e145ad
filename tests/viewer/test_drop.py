"""Files that are brought to a page: whole ones, and hostile ones, as nacre itself reads them."""

from __future__ import annotations

import base64
import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.formats import formats
from nacre.mitsuba.studio import studio
from nacre.neural.file import encode
from nacre.neural.inputs import INPUTS, input_count, rotates_half_vector
from nacre.neural.nbrdf import NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.viewer.content import Entry
from tests.analytic.materials import EXAMPLES
from tests.measured.support import hemisphere
from tests.specimens import SPECIMENS, mutated
from tests.specimens.tables import mbsdf_file
from tests.targets.test_kinds import WRITTEN, network
from tests.tiers import tiered
from tests.viewer.tab import Tab, page, wait_for
from tests.viewer.test_tables import VALUES as EVALUATED

NAMES = {
    "nacre neural material": "paint.safetensors",
    "MERL": "paint.binary",
    "RGL": "paint.bsdf",
    "MDL": "paint.mbsdf",
    "comma-separated samples": "paint.csv",
}
TEXT = "comma-separated samples"  # of which a part may be whole
SIZES = (0, -1, 1, 2**31, 2**32 - 1, 2**62, 2**64 - 1)
VALUES = (math.nan, math.inf, 1e300, -3.4e38, 1e30, 1e-45, -1.0)
CUTS, DAMAGED = 40, 60
STRICTER = "holds spectra", "got true", "network of another kind", "makes a page with it"
"""Of what the page says of files that nacre reads and it does not."""

READ = """async ([name, contents]) => {
  const { drop } = window.page, found = [];
  const add = drop.add;
  drop.add = (made) => void found.push(made);
  const outcomes = [];
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  await drop.open(contents.map((text, k) => new File([bytes(text)], `${k} ${name}`)));
  drop.add = add;
  const said = document.getElementById("trouble").textContent;
  return [said, found.map((made) => made.known.File.split(" ")[0])];
}"""

WATCH = """() => {
  const { drop } = window.page, { open, add } = drop;
  const watched = (window.watched = { longest: 0, whole: 0 });
  drop.open = (files) => {
    const began = performance.now();
    let last = began;
    const timer = setInterval(() => {
      watched.longest = Math.max(watched.longest, performance.now() - last);
      last = performance.now();
    }, 1);
    drop.add = (made) => {
      clearInterval(timer);
      Object.assign(watched, { whole: last - began, size: made.table.grids.nodes.size });
      Object.assign(drop, { open, add });
    };
    return open.call(drop, files);
  };
}"""
PICTURES = """async () => {
  const found = [];
  for (const image of document.querySelectorAll(".material img")) {
    await image.decode();
    const canvas = document.createElement("canvas").getContext("2d");
    canvas.drawImage(image, 0, 0);
    found.push([...canvas.getImageData(0, 0, 96, 96).data]);
  }
  return found;
}"""
DROP = """([names, texts]) => {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const dataTransfer = new DataTransfer();
  names.forEach((name, k) => dataTransfer.items.add(new File([bytes(texts[k])], name)));
  const send = (type) =>
    document.body.dispatchEvent(
      new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true }),
    );
  send("dragover");
  const hidden = [document.getElementById("veil").hidden];
  send("drop");
  return [...hidden, document.getElementById("veil").hidden];
}"""


@pytest.fixture(scope="module")
def tab(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with Tab(chromium, tmp_path_factory.mktemp("drop")) as opened:
        opened.open(page("Drop", [Entry("One", {"Only": EXAMPLES["lambert"]})], [studio()]))
        opened.page.evaluate("() => { window.page.mode.changed = window.page.loop = () => {}; }")
        yield opened


def cut(kind: str) -> list[bytes]:
    """A file cut short within its header, and at some places behind it."""
    specimen = SPECIMENS[kind]
    content = specimen.files()[0]
    later = np.linspace(specimen.header, len(content) - 1, CUTS).astype(int)
    return [content[:length] for length in [*range(specimen.header), *later]]


def damaged(kind: str) -> Iterator[bytes]:
    """Whole files, files with untrue counts, odd values, and damage of any kind."""
    specimen, random = SPECIMENS[kind], Random(2)
    contents = specimen.files()
    yield from contents
    for size in SIZES:
        yield from specimen.sized(size)
    with np.errstate(over="ignore"):
        for value in VALUES:
            yield from specimen.valued(value)
    yield from (contents[0] + extra for extra in (b"\0", b"\n", b"x" * 100, contents[0]))
    for _ in range(DAMAGED):
        yield mutated(random.choice(contents), random)
        yield specimen.rebuild(random.choice(contents), random)
    yield from (SPECIMENS[other].files()[0] for other in NAMES if other != kind)


def problem(content: bytes, kind: str, path: Path) -> str:
    """What nacre says is wrong with a file; empty where it reads it."""
    path.write_bytes(content)
    (entry,) = (entry for entry in formats() if entry.name == kind)
    try:
        entry.load(path)
    except FormatError as error:
        return str(error).removeprefix(f"{path}: ")
    return ""


def brought(tab: Tab, name: str, contents: Sequence[bytes]) -> list[str]:
    """What the page says is wrong with each file; empty where it reads it."""
    texts = [base64.b64encode(content).decode() for content in contents]
    said, read = tab.page.evaluate(READ, [name, texts])
    refused = dict(line.split(f" {name}: ", 1) for line in said.splitlines())
    assert sorted([*refused, *read], key=int) == [str(k) for k in range(len(contents))]
    return [refused.get(str(k), "") for k in range(len(contents))]


@pytest.mark.parametrize("kind", NAMES)
def test_the_page_refuses_what_nacre_refuses(tab: Tab, tmp_path: Path, kind: str) -> None:
    contents = list(damaged(kind))
    found = brought(tab, NAMES[kind], contents)
    wanted = [problem(content, kind, tmp_path / NAMES[kind]) for content in contents]
    differ = [
        (theirs, ours)
        for theirs, ours in zip(wanted, found, strict=True)
        if bool(theirs) != bool(ours) and not any(part in ours for part in STRICTER)
    ]
    assert not differ, differ
    said = [
        theirs[:12] == ours[:12]
        for theirs, ours in zip(wanted, found, strict=True)
        if theirs and not any(part in ours for part in STRICTER)
    ]
    assert np.mean(said) > 0.8


@pytest.mark.parametrize("kind", [kind for kind in NAMES if kind != TEXT])
def test_a_file_cut_short_is_refused(tab: Tab, kind: str) -> None:
    assert all(brought(tab, NAMES[kind], cut(kind)))


NETWORKS = [
    {"inputs": inputs, "isotropic": isotropic}
    for inputs, isotropic in itertools.product(INPUTS, (True, False))
    if not isotropic or rotates_half_vector(inputs, True)
]
ANGLED = {"inputs": "enhanced", "isotropic": False, "angle": 0.7, "activation": "squared relu"}


@pytest.mark.parametrize(
    "shape",
    tiered([*NETWORKS, ANGLED], [NETWORKS[0], ANGLED]),
    ids=lambda shape: "-".join(map(str, shape.values())),
)
def test_networks_of_any_shape_are_shown(tab: Tab, tmp_path: Path, shape: dict[str, Any]) -> None:
    count = input_count(shape["inputs"], shape["isotropic"])
    made = network(count, 9, 5, 7, 3, scale=3.0, **shape)
    *hidden, last = made.layers
    made = made.with_layers([*hidden, Layer(last.weights, np.abs(last.biases) + 0.5)])
    path = tmp_path / "network.safetensors"
    path.write_bytes(encode(made))
    index = tab.page.evaluate("window.page.materials.list.length")
    tab.page.locator("input[type=file]").set_input_files(path)
    tab.wait(f"window.page.materials.list.length > {index}")
    wi, wo = (hemisphere(np.random.default_rng(seed), 200) for seed in (0, 1))
    found = tab.page.evaluate(EVALUATED, [index, wi.ravel().tolist(), wo.ravel().tolist()])
    wanted = made.eval(wi, wo)
    assert wanted.std() > 0.02
    np.testing.assert_allclose(np.reshape(found, (-1, 4))[:, :3], wanted, 5e-4, 1e-3)


def test_a_network_too_large_to_draw_is_refused(tab: Tab, tmp_path: Path) -> None:
    path = tmp_path / "large.safetensors"
    path.write_bytes(encode(network(6, 100, 100, 3)))
    tab.page.locator("input[type=file]").set_input_files(path)
    tab.wait("document.getElementById('trouble').textContent.includes('11103 weights')")


def test_a_large_table_does_not_stop_the_page(tab: Tab, tmp_path: Path) -> None:
    path = tmp_path / "large.binary"
    path.write_bytes(np.array([90, 90, 180], "<i4").tobytes() + bytes(8 * 3 * 90 * 90 * 180))
    tab.page.evaluate(WATCH)
    tab.page.locator("input[type=file]").set_input_files(path)
    tab.wait("window.watched.whole")
    watched = tab.page.evaluate("window.watched")
    # Read in the page itself, the file would take one gap as long as the whole.
    assert watched["longest"] < 0.5 * watched["whole"]
    assert watched["size"] == [180, 90, 90]


def test_files_are_dropped_and_what_fails_is_said(chromium: Any, tmp_path: Path) -> None:
    shown = WRITTEN["smooth"]
    assert isinstance(shown, NeuralBrdf)
    with Tab(chromium, tmp_path) as tab:
        tab.open(page("Drop", [Entry("One", {"Network": shown})], [studio()]))
        tab.page.evaluate("window.page.renderer.resize(96, 96)")  # software draws it
        names = "<b>paint.mbsdf", "dark.safetensors", "notes.txt", "cut.binary"
        contents = mbsdf_file(), encode(shown), b"hello", b"\1\0\0\0"
        texts = [base64.b64encode(content).decode() for content in contents]
        assert tab.page.evaluate(DROP, [names, texts]) == [False, True]
        tab.wait("window.page.materials.list.length === 3")
        tab.wait("!document.getElementById('reading').textContent")
        said = (tab.page.locator("#trouble").text_content() or "").splitlines()
        assert said == [
            "notes.txt: is of a kind that this page does not read; it reads .safetensors, "
            ".binary, .bsdf, .mbsdf, .csv",
            "cut.binary: ends within the header; the file is cut short",
        ]
        listed = tab.page.locator(".material .title").all_text_contents()
        assert listed == ["One", "<b>paint", "dark"]
        assert tab.page.locator("#name").text_content() == "dark"
        wi, wo = (hemisphere(np.random.default_rng(seed), 50) for seed in (0, 1))
        found = tab.page.evaluate(EVALUATED, [2, wi.ravel().tolist(), wo.ravel().tolist()])
        wanted = shown.eval(wi, wo)
        np.testing.assert_allclose(np.reshape(found, (-1, 4))[:, :3], wanted, 5e-4, 1e-3)
        packed, _, drawn = tab.page.evaluate(PICTURES)
        assert np.abs(np.subtract(packed, drawn)).mean() < 4.0
        assert np.std(drawn) > 20.0
        tab.keep("drop")


@pytest.mark.slow
def test_files_are_opened_with_keys_alone(chromium: Any, tmp_path: Path) -> None:
    path = tmp_path / "paint.mbsdf"
    path.write_bytes(mbsdf_file())
    with Tab(chromium, tmp_path, size=(360, 740), color_scheme="dark") as tab:
        choosers: list[Any] = []
        tab.page.on("filechooser", lambda chooser: choosers.append(chooser))
        tab.open(page("Drop", [Entry("One", {"Only": EXAMPLES["lambert"]})], [studio()]))
        tab.page.locator("#search").focus()
        for key in ("Tab", "Enter"):
            tab.page.keyboard.press(key)
        wait_for(tab.page, lambda: choosers, "a chooser of files")
        choosers[0].set_files(path)
        tab.wait("window.page.chosen.name === 'paint'")
        assert tab.page.evaluate("document.documentElement.scrollWidth") == 360
        tab.keep("drop-narrow")
