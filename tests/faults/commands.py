"""The long commands, each as a small real job: what it reads, writes, and promises."""

from __future__ import annotations

import functools
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import nacre
from nacre.analytic import Ggx
from nacre.brdf import Brdf
from nacre.io.outputs import overwrite
from tests.download.server import serving
from tests.workflows.processes import scheduler

ROOT = Path(__file__).resolve().parents[2]
PYTHON = sys.executable
NACRE = PYTHON, "-m", "tests.faults.child"
DIRECTIONS = [(0, 0), *((theta, phi) for theta in (25, 50, 70) for phi in (0, 90, 180, 270))]


def _paint(roughness: float, diffuse: float) -> Ggx:
    color = (diffuse, 0.6 * diffuse, 0.4 * diffuse)
    return Ggx(diffuse=color, specular=(0.05, 0.05, 0.05), roughness=roughness)


@functools.cache
def _content(kind: str, variant: int) -> bytes:
    """A measured file or picture of a made-up material; variants differ in every value."""
    with tempfile.TemporaryDirectory() as folder, overwrite():
        path = Path(folder) / f"a.{kind}"
        material = _paint(0.1 + 0.07 * variant, 0.1 + 0.05 * variant)
        if kind == "npz":
            _texture(material, path)
        elif kind in ("photo.exr", "sky.exr"):
            _photograph(material, path)
        elif kind == "directions.csv":
            rows = "\n".join(f"{theta},{phi}" for theta, phi in DIRECTIONS[: 13 - variant])
            path.write_text(f"theta,phi\n{rows}\n")
        else:
            nacre.save(material, path)
        return path.read_bytes()


def _texture(material: Brdf, path: Path) -> None:
    """16 x 16 texels, brighter from left to right and darker downwards, with some grain."""
    theta, phi = np.radians(np.array(DIRECTIONS, float)).T
    d = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)
    wi, wo = np.repeat(d, len(d), axis=0), np.tile(d, (len(d), 1))
    edge = np.linspace(0.5, 1.5, 16)
    grain = np.random.default_rng(0).uniform(0.8, 1.2, (16, 16))
    gains = np.pi * edge[None, :] * edge[::-1, None] * grain
    values = gains[..., None, None] * material.eval(wi, wo)
    np.savez(path, values=values.astype(np.float16), wi=wi, wo=wo, name=np.array("cloth"))


def _photograph(material: Brdf, path: Path) -> None:
    """A sphere under a sky, or the sky."""
    from nacre.mitsuba.environment import Environment
    from nacre.mitsuba.lights import EnvironmentLight
    from nacre.mitsuba.preview import write_image
    from nacre.mitsuba.sphere import render_sphere

    pixels = np.full((16, 32, 3), 0.3, np.float32)
    pixels[3:6, 18:21] = 8.0
    sky = Environment(pixels)
    if path.name.endswith("sky.exr"):
        write_image(sky.pixels, path)
    else:
        write_image(render_sphere(material, EnvironmentLight(sky), 20)[0], path)


@dataclass(frozen=True)
class Long:
    """A long command.

    Parameters
    ----------
    arguments
        What is run in a folder with `inputs` in it; it writes into `out` there.
    inputs
        Files by the kind and variant of their content.
    outputs
        What is in `out` when it is done, as patterns.
    states
        What may lie there besides when it was stopped: states, and what it keeps to go on.
    journals
        Outputs that hold times or are added to, so that their bytes vary.
    several
        Whether it has several results, of which one may fail alone: exit code 1.
    called
        Name of a command that writes one file, in place of one that it wrote before.
    service
        What it needs to run meanwhile, whose address becomes an argument `{url}`.
    """

    arguments: tuple[str, ...]
    inputs: dict[str, tuple[str, int]]
    outputs: tuple[str, ...]
    states: tuple[str, ...] = ()
    journals: tuple[str, ...] = ()
    several: bool = False
    called: str = ""
    service: Callable[[], AbstractContextManager[str]] | None = None

    def prepare(self, folder: Path) -> None:
        """Write the inputs."""
        for name in self.inputs:
            self.write_input(folder, name)
        if self.arguments[1:2] == ("scripts/gallery.py",):  # it writes beside where it lies
            (folder / "scripts").mkdir()
            shutil.copy(ROOT / "scripts/gallery.py", folder / "scripts")
            (folder / "gallery").symlink_to(ROOT / "gallery")

    def write_input(self, folder: Path, name: str, other: bool = False) -> None:
        """Write one of the inputs, or another of its kind in its place, at once."""
        kind, variant = self.inputs[name]
        path = folder / "inputs" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.with_name("new").write_bytes(_content(kind, variant + 5 * other))
        path.with_name("new").replace(path)

    @contextmanager
    def command(self) -> Iterator[list[str]]:
        """What to run; the service that it needs is there meanwhile."""
        with self.service() if self.service else nullcontext("") as url:
            yield [argument.format(url=url) for argument in self.arguments]


@contextmanager
def slow_server() -> Iterator[str]:
    """Sends the same measurement under every name, in pieces."""
    with serving(_content("bsdf", 0)) as server:
        server.pause = 0.02
        yield server.url


@contextmanager
def _cluster() -> Iterator[str]:
    """A scheduler, and two workers of a thread each."""
    with (
        tempfile.TemporaryDirectory() as folder,
        scheduler(Path(folder)) as started,
        started.workers(2),
    ):
        yield started.address


def _nacre(line: str) -> tuple[str, ...]:
    return (*NACRE, *line.split())


_TABLES = {f"m{n}.bsdf": ("bsdf", n) for n in range(3)}
_TEXTURES = {f"cloth{n}.npz": ("npz", n) for n in range(2)}
_SHORT = "--steps 40 --code-dim 4"
_QUICK = "--preset draft --samples 5000 --epochs 20"

LONG = {
    "fit": Long(
        _nacre("fit inputs/m0.bsdf -o out/m0.safetensors --preset draft"),
        {"m0.bsdf": ("bsdf", 0)},
        ("m0.safetensors",),
        called="nacre fit",
    ),
    "library": Long(
        _nacre(f"fit inputs -o out/library {_QUICK}"),
        {f"m{n}.bsdf": ("bsdf", n % 3) for n in range(6)},
        ("library/*.safetensors", "library/library.jsonl"),
        states=("library/library.jsonl.lock", "library/.*.lock"),
        journals=("library/library.jsonl",),
        several=True,
    ),
    "cluster": Long(
        _nacre(f"fit inputs -o out/library --scheduler {{url}} {_QUICK}"),
        {f"m{n}.bsdf": ("bsdf", n % 3) for n in range(6)},
        ("library/*.safetensors", "library/library.jsonl"),
        states=("library/library.jsonl.lock", "library/.*.lock"),
        journals=("library/library.jsonl",),
        several=True,
        service=_cluster,
    ),
    "latent-neural": Long(
        _nacre(f"latent train inputs -o out/basis.safetensors --model neural {_SHORT}"),
        _TABLES,
        ("basis.safetensors",),
        states=("basis.safetensors.state*", "basis.safetensors.*.state"),
        called="nacre latent train",
    ),
    "latent-hypernetwork": Long(
        _nacre(f"latent train inputs -o out/basis.safetensors --model hypernetwork {_SHORT}"),
        _TABLES,
        ("basis.safetensors",),
        states=("basis.safetensors.state*", "basis.safetensors.*.state"),
        called="nacre latent train",
    ),
    "latent-autoencoder": Long(
        _nacre(
            f"latent train inputs -o out/basis.safetensors --model autoencoder {_SHORT} "
            "--mixtures 4"
        ),
        _TABLES,
        ("basis.safetensors",),
        states=("basis.safetensors.state*", "basis.safetensors.*.state"),
        called="nacre latent train",
    ),
    "train-basis": Long(
        _nacre(
            "btf train inputs/cloth0.npz inputs/cloth1.npz -o out/codec.safetensors "
            f"--resume {_SHORT}"
        ),
        _TEXTURES,
        ("codec.safetensors",),
        states=("codec.safetensors.state*",),
        called="nacre btf train",
    ),
    "train-unified": Long(
        _nacre(
            "btf train inputs/cloth0.npz inputs/cloth1.npz -o out/codec.safetensors "
            f"--resume --model unified {_SHORT}"
        ),
        _TEXTURES,
        ("codec.safetensors", "codec.safetensors.journal.csv"),
        states=("codec.safetensors.state*",),
        journals=("codec.safetensors.journal.csv",),
        called="nacre btf train",
    ),
    "train-custom": Long(
        _nacre(
            "btf train inputs/cloth0.npz -o out/codec.safetensors --resume --model custom "
            "--steps 40"
        ),
        {"cloth0.npz": ("npz", 0)},
        ("codec.safetensors", "codec.safetensors.journal.csv"),
        states=("codec.safetensors.state*",),
        journals=("codec.safetensors.journal.csv",),
        called="nacre btf train",
    ),
    "encode": Long(
        _nacre("fit inputs/cloth0.npz -o out/codes.safetensors --resume --texels-per-block 16"),
        {"cloth0.npz": ("npz", 0)},
        ("codes.safetensors",),
        states=("codes.safetensors.state*",),
        called="nacre fit",
    ),
    "encode-cluster": Long(
        _nacre(
            "fit inputs/cloth0.npz -o out/codes.safetensors --resume --texels-per-block 16 "
            "--scheduler {url}"
        ),
        {"cloth0.npz": ("npz", 0)},
        ("codes.safetensors",),
        states=("codes.safetensors.state*",),
        called="nacre fit",
        service=_cluster,
    ),
    "capture": Long(
        _nacre(
            "btf capture fabric01 -o out/cloth.npz --texels 16 --paths 16 "
            "--directions inputs/directions.csv"
        ),
        {"directions.csv": ("directions.csv", 0)},
        ("cloth.npz",),
        called="nacre btf capture",
    ),
    "capture-all": Long(
        _nacre(
            "btf capture --all -o out/surfaces --texels 2 --paths 1 "
            "--directions inputs/directions.csv"
        ),
        {"directions.csv": ("directions.csv", 9)},
        ("surfaces/*/*.npz", "surfaces/capture.json"),
        states=("surfaces/.lock",),
    ),
    "convert": Long(
        _nacre("convert inputs/m0.bsdf -o out/m0.npz"),
        {"m0.bsdf": ("bsdf", 0)},
        ("m0.npz",),
        called="nacre convert",
    ),
    "view": Long(
        _nacre("view inputs/m0.bsdf -o out/page.html"),
        {"m0.bsdf": ("bsdf", 0)},
        ("page.html",),
        called="nacre view",
    ),
    "download": Long(
        _nacre(
            "download rgl-spectral paper_white satin_rosaline --mirror {url} --accept-terms -o out"
        ),
        {},
        ("*_spec.bsdf", "*_spec.bsdf.json", "*-TERMS.txt"),
        states=(".*.part.bsdf*", ".*.lock"),
        journals=("*.json",),
        several=True,
        service=slow_server,
    ),
    "reproduce": Long(
        _nacre(
            "reproduce table1 inputs/m0.bsdf inputs/m1.bsdf -o out/table --quick --size 16 "
            "--methods ggx,nbrdf-105"
        ),
        {name: _TABLES[name] for name in ("m0.bsdf", "m1.bsdf")},
        ("table/table1.csv", "table/table1.md", "table/cache/*"),
        states=("table/cache/*",),
        journals=("table/cache/*", "table/table1.csv"),
    ),
    "estimate": Long(
        _nacre(
            "estimate inputs/photo.exr --geometry sphere --environment inputs/sky.exr "
            "-o out/paint.json"
        ),
        {"photo.exr": ("photo.exr", 0), "sky.exr": ("sky.exr", 0)},
        ("paint.json",),
        states=("paint.json.state*",),
        called="nacre estimate",
    ),
    "gallery": Long(
        (PYTHON, "scripts/gallery.py"),
        {},
        ("gallery/library/*/*",),
    ),
}
"""All of them, by the names that `python -m tests.faults` takes."""
