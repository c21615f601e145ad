"""The page on the two papers: it has every number of theirs, and each of its commands works.

Commands run as they stand on the page, in a folder of tiny files with the names that it uses; only
what makes them short is added at their end. Pictures are noise: to compile a path-traced scene
takes ten seconds, and tests of `render` and of `reproduce` trace some.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'latent'")
pytest.importorskip("openTSNE", reason="needs the extra 'latent'")
pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
pytest.importorskip("mitsuba", reason="needs the extra 'render'")
pytest.importorskip("skimage", reason="needs the extra 'render'")

import nacre
from nacre.analytic import AnisotropicGgx
from nacre.cli import root
from nacre.errors import NacreError
from nacre.latent.file import save_basis
from nacre.measured import merl, rgl_writer
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.passes import Accumulation
from nacre.neural import NeuralBrdf
from nacre.neural.nbrdf import HIDDEN
from nacre.neural.training import initial_layers
from nacre_lab.reproduce import EXPERIMENTS
from nacre_lab.reproduce.codes import CODES
from nacre_lab.reproduce.methods import methods
from nacre_lab.reproduce.samplers import SAMPLERS
from nacre_lab.reproduce.textures.methods import find
from nacre_lab.reproduce.trial import Settings
from tests.analytic.materials import EXAMPLES
from tests.cli.support import run
from tests.latent.made import basis, material, random_autoencoder
from tests.textures.codecs.networks.conftest import one_thread
from tests.textures.codecs.networks.made import OTHER, texture
from tests.textures.made import write

__all__ = ["one_thread"]

PAGE = Path(__file__).parents[2] / "docs" / "papers.md"

REFLECTANCE = (
    *(f"Section {n}" for n in ("1", "2", "2.1", "2.2", "2.3", "3", "3.1", "3.2", "3.3", "3.4")),
    *(f"Section {n}" for n in ("4", "4.1", "4.2", "4.3", "4.4", "4.5", "5")),
    "Equation 1",
    *(f"Table {n}" for n in range(1, 4)),
    *(f"Figure {n}" for n in range(1, 18)),
)
TEXTURES = (
    *(f"Section {n}" for n in ("1", "2", "3", "4", "5", "5.1", "5.2", "6")),
    "Table 1",
    *(f"Figure {n}" for n in range(1, 11)),
)
"""What has a number in the papers, typed from them. That of 2020 numbers no equation."""

PARSED = {
    "download ": "the network is not there; tests/download has a server",
    "btf capture --all": "84 captures; tests/cli/test_btf.py makes them, tiny",
    "latent train merl/*.binary --model autoencoder": "fits 300 networks; tests/latent trains one",
}
"""Beginnings of commands of which only the options are read here, and why."""

CHEAP = (
    ("table2", "neural"),
    ("table|fig([256789]|10|17)$", "lambert"),
    ("fig1[3-6]$", "uniform,own"),
    ("btf-", "unified-4"),
)
"""Methods that are tried in place of those that experiments take, by a pattern of their names; that
those which the page names exist is a test of its own."""
ADDED = (
    ("fit .*--model ggx", "--samples 2000"),
    ("fit (merl|anisotropic)", "--epochs 1 --samples 2000"),
    ("latent train .*--model pca", "--resolution 8,4,4 --code-dim 2"),
    ("btf train .*--epochs", "--epochs 1"),
    ("btf train", "--steps 2"),
    ("btf capture", "--texels 2 --paths 1 --directions few.csv"),
    ("compare merl", "--size 16"),
    ("convert", "--resolution 8,8,8"),
    ("render", "--size 16 --spp 1"),
)
"""What makes other commands short, by a pattern of their beginning; the first that fits counts."""
LENGTHS = {"steps": "2", "minutes": "0.001"}
"""Of trainings in experiments, by the option: the first that they heed."""


def rows() -> list[tuple[str, list[str]]]:
    """The part of the page that a row of a table is in, and its cells."""
    found, part = [], ""
    for line in PAGE.read_text("utf-8").splitlines():
        if line.startswith("## "):
            part = line[3:]
        elif line.startswith("| ") and not re.match(r"\| (there|item|section) \|", line):
            found.append((part, [cell.strip() for cell in line.strip("|").split("|")]))
    return found


def commands(cells: list[str]) -> list[str]:
    """Arguments of the commands of a row: cells that are nothing else."""
    return [found[1] for cell in cells if (found := re.fullmatch(r"`nacre ([^`]+)`", cell))]


COMMANDS = sorted({command for _, cells in rows() for command in commands(cells)})


def experiment(command: str) -> str:
    """Name of what `nacre reproduce` makes, if that is known; empty of other commands."""
    verb, name, *_ = command.split()
    return name if verb == "reproduce" and name in EXPERIMENTS else ""


def chosen(command: str) -> list[str]:
    """Methods that a command names."""
    found = re.search(r" --methods (\S+)", command)
    return found[1].split(",") if found else []


def without_methods(command: str) -> str:
    """A command but for the methods that it names."""
    return re.sub(r" --methods \S+", "", command)


def short(command: str) -> str:
    """A command with what makes it short at its end, and cheap methods in place of its own."""
    name = experiment(command)
    if any(command.startswith(start) for start in PARSED):
        return command
    if not name:
        return f"{command} {first(ADDED, command)}".strip()
    heeds = EXPERIMENTS[name].heeds
    command = re.sub(r" --(steps|epochs) \d+", r" --\1 1", without_methods(command))
    options = ["--methods", first(CHEAP, name)] if "methods" in heeds else []
    if "size" in heeds:
        options.append("--size 16")
    if "published" in heeds:
        options.append("--epochs 1")  # --quick means twenty, and larger pictures
    elif "quick" in heeds:
        options.append("--quick")
    lengths = [f"--{unit} {n}" for unit, n in LENGTHS.items() if unit in heeds]
    if not re.search(r" --(steps|epochs) 1\b", command):
        options += lengths[:1]
    return " ".join([command, *options])


def first(patterns: tuple[tuple[str, str], ...], text: str) -> str:
    """What belongs to the first pattern that a text begins with; nothing if there is none."""
    return next((found for pattern, found in patterns if re.match(pattern, text)), "")


SHORT = {short(command): without_methods(command) for command in COMMANDS}
"""What is run, and a command of the page that it stands for."""


def arguments(command: str) -> list[str]:
    """What a shell makes of a command; files that others read are written elsewhere."""
    found: list[str] = []
    for word in shlex.split(command):
        if word != "out" and found and found[-1] in ("-o", "--height-map"):
            found.append(f"made/{Path(word).name}")
        else:
            files = sorted(map(str, Path().glob(word))) if re.search(r"/.*\*", word) else [word]
            found += files
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the page says that there is, tiny."""
    where = tmp_path_factory.mktemp("papers")
    for name in ("merl", "rgl", "anisotropic", "networks", "made"):
        (where / name).mkdir()
    names = "chrome", "pink-felt", "grease-covered-steel", "black-oxidized-steel", "alum-bronze"
    grid, table = merl.Resolution(8, 8, 8), rgl_writer.Resolution(1, 4, 8, 8, 8)
    for seed, name in enumerate(names):
        nacre.save(material(seed), where / f"merl/{name}.binary", resolution=grid)
    for seed, name in enumerate(("cc_ibiza_sunset", "satin_rosaline")):
        nacre.save(material(seed), where / f"rgl/{name}_rgb.bsdf", resolution=table)
    brushed = EXAMPLES[AnisotropicGgx.model]
    turned = replace(table, phi_i=4)
    nacre.save(brushed, where / "anisotropic/aniso_miro_7_rgb.bsdf", resolution=turned)
    for seed, name in enumerate(names[:2]):
        network = NeuralBrdf(initial_layers(HIDDEN, seed), name=name)
        nacre.save(network, where / f"networks/{name}.h5")
    nacre.save(network, where / "chrome.safetensors")
    autoencoder = random_autoencoder()
    known = {"materials": [material(seed).name for seed in range(3)]}
    save_basis(replace(autoencoder, metadata=known), where / "autoencoder.safetensors")
    save_basis(basis(), where / "pca.safetensors")
    (where / "captured").mkdir()
    write(texture(5), where / "relief/leather12.npz")
    heights = np.random.default_rng(0).random((8, 8, 1), np.float32)
    mitsuba().Bitmap(0.1 * heights).write(str(where / "relief/leather12.exr"))
    for index, name in enumerate(("felt01", "felt02", "leather01")):
        write(texture(index), where / f"captured/train/{name}.npz")
    write(texture(3), where / "captured/unseen/leather12.npz")
    write(texture(4, directions=OTHER), where / "utia/leather12-utia.npz")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        (where / "few.csv").write_text("theta,phi\n0,0\n30,0\n30,120\n30,240\n")
        textures = sorted(map(str, where.glob("captured/train/*.npz")))
        model = "--model", "unified", "--code-dim", "4", "--steps", "1"
        assert run("btf", "train", *textures, *model, "-o", "unified.safetensors") == 0
        codec = "--codec", "unified.safetensors", "-o", "leather12.safetensors"
        assert run("fit", "captured/unseen/leather12.npz", *codec) == 0
    return where


@pytest.fixture
def noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of random numbers, in place of path-traced ones."""

    def render(self: Any, mi: Any, part: slice, samples: int, seed: int) -> None:
        rows, width = self._total[part].shape[:2]
        channels = 3 + len((self._integrator or self._scene.integrator()).aov_names())
        if not self._total.size:
            self._total = np.zeros((*self._total.shape[:2], channels))
        self._total[part] += samples * np.random.default_rng(seed).random((rows, width, channels))
        self._counts[part] += samples

    monkeypatch.setattr(Accumulation, "_render", render)


def parse(command: str) -> None:
    """Read the options of a command, and check that its files are there."""
    found: click.Command = root
    context, rest = click.Context(root, info_name="nacre"), arguments(command)
    while isinstance(found, click.Group):
        name, *rest = rest
        inner = found.get_command(context, name)
        assert inner is not None, f"no command {name}"
        found = inner
    found.make_context(found.name, rest, context)


@pytest.mark.parametrize("command", SHORT, ids=[command[:90] for command in SHORT])
def test_commands_of_the_page_work(
    command: str, folder: Path, noise: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    if any(command.startswith(start) for start in PARSED):
        parse(command)
    else:
        assert run(*arguments(command)) == 0


def test_what_is_not_run_is_on_the_page() -> None:
    for start in PARSED:
        assert any(command.startswith(start) for command in COMMANDS), start


def is_known(name: str, method: str) -> bool:
    """Whether an experiment has a method."""
    if name.startswith("btf-"):
        try:
            find(method)
        except NacreError:
            return False
        return True
    if re.match("fig1[3-6]", name):
        return method in SAMPLERS
    return method in (CODES if name == "table2" else methods(Settings()))


def test_methods_that_the_page_names_exist() -> None:
    named = {(command.split()[1], method) for command in COMMANDS for method in chosen(command)}
    assert {method for name, method in named if not is_known(name, method)} == set()


@pytest.mark.parametrize(("title", "items"), [("(2021)", REFLECTANCE), ("(2020)", TEXTURES)])
def test_every_number_of_the_papers_is_on_the_page(title: str, items: tuple[str, ...]) -> None:
    firsts = [cells[0] for part, cells in rows() if part.endswith(title)]
    listed = {re.split("[:,]", first)[0] for first in firsts}
    numbered = {item for item in listed if re.match("Section|Equation|Table|Figure", item)}
    assert numbered == set(items)


def test_every_line_is_a_command_and_every_item_says_how_it_stands() -> None:
    states = "reproduced", "differs: ", "not done: ", "background", "see "
    for _, cells in rows():
        assert len(commands(cells)) == 1, cells
        if re.match("Abstract|Section|Equation|Table|Figure", cells[0]):
            assert cells[-1].startswith(states), cells
