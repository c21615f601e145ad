"""Materials from photographs, beside what Mitsuba's own materials come to with the same pictures.

A seeded fifth of the published MERL networks is held out, as in
:mod:`lab.studies.ablations.few_samples`; with four measured RGL tables they are the materials. The
basis knows only the other networks. Mitsuba's path integrator renders each as a sphere in the
museum, seen by one to four cameras, and the pictures get the noise of a camera: of photons and of
reading.

- `nacre estimate`: see :mod:`nacre.photographs.estimate`; the network that it writes;
- `principled`, `roughconductor`: Mitsuba's plugins, all parameters of theirs that are continuous,
  by Adam on gradients of `mi.render`, from three starts of which the one that fits better counts.

Errors are those of spheres relit by two environments in which none was photographed. Sheets show
the truth, the estimate and the peers in one, then in the other.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import nacre
from lab.studies.study import Study, data, log, museum, progress
from nacre.array import Image
from nacre.brdf import Brdf
from nacre.errors import require
from nacre.latent import save_basis
from nacre.measuring.virtual import MitsubaBrdf
from nacre.metrics.metrics import image_errors
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.lights import EnvironmentLight
from nacre.mitsuba.plugins import bsdf, register
from nacre.mitsuba.sphere import render_sphere
from nacre.mitsuba.surroundings import ENVIRONMENTS
from nacre.photographs.estimate import Photographed, Setting, estimate_from_photographs
from nacre_lab.reproduce.codes import CodeSettings, bases, split

TABLES = "acrylic_felt_green", "cc_ibiza_sunset", "colodur_napoli_4f", "satin_rosaline"
RELIT = "studio", "late sun"
COUNTS = 1, 4
SIZE = 64
"""Pixels along an edge of a photograph."""
TRUE_SAMPLES = 512
RELIT_SIZE, RELIT_DIRECTIONS = 96, 512
PHOTONS = 4000.0
"""That a pixel of value 1 counts."""
READING = 1e-3
"""Standard deviation of the noise of reading."""
STEPS, STEP_SAMPLES, RATE = 300, 16, 0.02
"""Of the peers: steps, samples of a pixel in each, the learning rate of Adam."""
BLACK = 0.1
"""Added to pixels by which differences are divided, in their mean. Logarithms of rendered pixels,
which are noisy, would be too low in the mean, and materials too bright."""

_COLOR = {"type": "rgb", "value": [0.5, 0.5, 0.5]}
_ONE = {"type": "rgb", "value": [1.5, 1.5, 1.5]}


class Peer(NamedTuple):
    """A plugin of Mitsuba's: its starts, and the ranges of its parameters by name."""

    starts: Sequence[Mapping[str, Any]]
    ranges: Mapping[str, tuple[float, float]]


PEERS = {
    "principled": Peer(
        [
            {
                "type": "principled",
                "base_color": _COLOR,
                "roughness": roughness,
                "metallic": metallic,
                "specular": 0.5,
                "spec_tint": 0.2,
                "sheen": 0.1,
                "sheen_tint": 0.2,
                "clearcoat": 0.1,
                "clearcoat_gloss": 0.8,
                "flatness": 0.0,
            }
            for roughness, metallic in ((0.08, 1.0), (0.25, 0.5), (0.5, 0.1))
        ],
        {
            "base_color.value": (0.0, 1.0),
            "roughness.value": (0.02, 1.0),
            "metallic.value": (0.0, 1.0),
            "eta": (1.01, 3.0),
            "specular": (0.01, 1.0),
            "spec_tint.value": (0.0, 1.0),
            "sheen.value": (0.0, 1.0),
            "sheen_tint.value": (0.0, 1.0),
            "clearcoat.value": (0.0, 1.0),
            "clearcoat_gloss.value": (0.0, 1.0),
        },
    ),
    "roughconductor": Peer(
        [
            {
                "type": "roughconductor",
                "distribution": "ggx",
                "alpha": alpha,
                "eta": _ONE,
                "k": _ONE,
                "specular_reflectance": _COLOR,
            }
            for alpha in (0.03, 0.1, 0.4)
        ],
        {
            "alpha.value": (0.005, 1.0),
            "eta.value": (0.1, 5.0),
            "k.value": (0.0, 8.0),
            "specular_reflectance.value": (0.0, 1.0),
        },
    ),
}


def scene(environment: Image, material: Any, count: int) -> Any:
    """A sphere in an environment, seen by so many cameras."""
    mi = mitsuba()
    film = {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}}
    described = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "light": {"type": "envmap", "bitmap": mi.Bitmap(environment)},
        "shape": {"type": "sphere", "bsdf": material},
    }
    for index in range(count):
        angle = np.radians(360.0 * index / max(COUNTS))
        place = [5.0 * np.sin(angle), 1.0, 5.0 * np.cos(angle)]
        view = mi.ScalarTransform4f().look_at(place, [0, 0, 0], [0, 1, 0])
        described[f"camera{index}"] = {
            "type": "perspective",
            "fov": 24.5,
            "to_world": view,
            "film": film,
        }
    return mi.load_dict(described)


def photographs(environment: Image, truth: Brdf, count: int, seed: int) -> list[Image]:
    """Rendered by Mitsuba, with the noise of a camera."""
    mi = mitsuba()
    made = scene(environment, bsdf(truth), count)
    random = np.random.default_rng((seed, 13))
    found = []
    for index in range(count):
        image = np.array(mi.render(made, sensor=index, spp=TRUE_SAMPLES, seed=index))[..., :3]
        found.append(noisy(image, random))
    return found


def noisy(image: Image, random: np.random.Generator) -> Image:
    """With the noise of a camera."""
    deviation = np.sqrt(np.maximum(image, 0.0) / PHOTONS + READING**2)
    return np.asarray(image + deviation * random.normal(size=image.shape), np.float32)


def optimized(peer: Peer, environment: Image, pictures: Sequence[Image], name: str) -> Brdf:
    """The start that fits better after all steps."""
    mi, dr = mitsuba(), require("drjit", "render")
    best: tuple[float, Any] | None = None
    for start in peer.starts:
        made = scene(environment, dict(start), len(pictures))
        parameters = mi.traverse(made)
        keys = {f"shape.bsdf.{k}": v for k, v in peer.ranges.items()}
        keys = {k: v for k, v in keys.items() if k in parameters}
        optimizer = mi.ad.Adam(lr=RATE)
        for key in keys:
            optimizer[key] = parameters[key]
        parameters.update(optimizer)
        losses = []
        for step in range(STEPS):
            index = step % len(pictures)
            seen = mi.TensorXf(pictures[index])
            black = BLACK * float(pictures[index].mean())
            shown = mi.render(made, parameters, sensor=index, spp=STEP_SAMPLES, seed=step)
            loss = dr.mean(dr.square((shown - seen) / (dr.maximum(seen, 0.0) + black)), axis=None)
            dr.backward(loss)
            optimizer.step()
            for key, (low, high) in keys.items():
                optimizer[key] = dr.clip(optimizer[key], low, high)
            parameters.update(optimizer)
            losses.append(float(loss.array[0]))
        last = float(np.mean(losses[-20:]))
        if best is None or last < best[0]:
            (shape,) = made.shapes()
            best = last, shape.bsdf()
    assert best is not None
    return MitsubaBrdf(best[1], name)


def relit(truth: Brdf, other: Brdf) -> tuple[list[float], list[tuple[Image, Image]]]:
    """PSNR in dB under both environments, and the pictures of each."""
    found, pictures = [], []
    for name in RELIT:
        light = EnvironmentLight(ENVIRONMENTS[name]().exposed(), RELIT_DIRECTIONS)
        (own, mask), (theirs, _) = (render_sphere(m, light, RELIT_SIZE) for m in (truth, other))
        errors, _ = image_errors(own, theirs, mask)
        found.append(errors.psnr)
        pictures.append((own, theirs))
    return found, pictures


def main() -> None:
    """Print the tables, and keep the pictures."""
    study = Study(__doc__, __file__)
    study.add_argument("--counts", type=int, nargs="*", default=COUNTS, help="photographs")
    study.add_argument("--only", nargs="*", help="names of materials")
    options = study.options()
    mi = mitsuba()
    register()
    settings = CodeSettings(seed=options.seed)
    settings = settings.quick() if options.quick else settings
    training, held_out = split(sorted(data("pretrained", "merl").glob("*.h5")), options.seed)
    basis = bases(training, ["neural"], settings, study.cache, progress)["neural"]
    path = study.output / "basis.safetensors"
    path.unlink(missing_ok=True)
    save_basis(basis, path)
    materials = [*held_out, *(data("rgl", f"{name}_rgb.bsdf") for name in TABLES)]
    if options.only:
        materials = [p for p in materials if p.stem.removesuffix("_rgb") in options.only]
    materials = study.few(materials, 1)
    environment = museum().exposed().pixels
    small = np.asarray(mi.Bitmap(environment).resample([512, 256]), np.float32)
    rows: list[tuple[str, ...]] = []
    scores: dict[int, list[list[float]]] = {}
    sheets: dict[int, list[Image]] = {}
    for index, file in enumerate(materials):
        truth = nacre.load(file)
        for count in options.counts:
            key = f"{file.stem}-{count}"

            def made(truth: Brdf = truth, count: int = count, index: int = index) -> Any:
                return trial(truth, small, count, path, index)

            known = study.cache.arrays(key, ["psnr", "seconds", "views"], made)
            psnr, seconds = known["psnr"], known["seconds"]
            sheets.setdefault(count, []).append(known["views"])
            scores.setdefault(count, []).append([*psnr.mean(axis=1), *seconds])
            cells = [f"{a:.1f} / {b:.1f}" for a, b in psnr]
            rows.append((file.stem.removesuffix("_rgb"), str(count), *cells))
            log(*rows[-1], *(f"{s:.0f} s" for s in seconds))
    columns = ("nacre estimate", *PEERS)
    study.table(
        ("material", "photographs", *columns), rows, "materials", "PSNR in dB, relit twice."
    )
    for count, views in sheets.items():
        write_sheet(views, study.output / f"relit-{count}.jpg")
    lines = []
    for count, found in scores.items():
        values = np.array(found)
        psnr, seconds = values[:, : len(columns)], values[:, len(columns) :]
        lead = psnr[:, 0] - psnr[:, 1:].max(axis=1)
        ahead = f"{lead.mean():+.1f} dB, better on {(lead > 0).sum()} of {len(lead)}"
        cells = [
            f"{p:.1f} dB, {s:.0f} s" for p, s in zip(psnr.mean(0), seconds.mean(0), strict=True)
        ]
        lines.append((str(count), *cells, ahead))
    study.table(("photographs", *columns, "ahead of the better peer"), lines, "means")


def trial(truth: Brdf, environment: Image, count: int, basis: Path, seed: int) -> Mapping[str, Any]:
    """PSNR of all methods on one material, seconds, and pictures side by side."""
    pictures = photographs(environment, truth, count, seed)

    def load(properties: dict[str, Any]) -> Any:
        return scene(environment, {"type": "nbrdf", "id": "material", **properties}, count)

    setting = Setting(load, "material", "study")
    psnr, seconds = [], []
    views: list[list[Image]] = [[] for _ in RELIT]

    def found_by_nacre() -> Photographed:
        return estimate_from_photographs(pictures, setting, str(basis))

    methods: dict[str, Callable[[], Brdf]] = {"nacre estimate": lambda: found_by_nacre().network()}
    for name, peer in PEERS.items():
        methods[name] = partial(optimized, peer, environment, pictures, name)
    for method in methods.values():
        start = time.perf_counter()
        found = method()
        seconds.append(time.perf_counter() - start)
        errors, shown = relit(truth, found)
        psnr.append(errors)
        for row, (own, theirs) in zip(views, shown, strict=True):
            row += [theirs] if row else [own, theirs]
    rows = [np.concatenate(row, axis=1) for row in views]
    return {
        "psnr": np.array(psnr),
        "seconds": np.array(seconds),
        "views": np.concatenate(rows, axis=1).astype(np.float32),
    }


def write_sheet(views: Sequence[Image], path: Path) -> None:
    """Pictures of materials, one below the other."""
    mi = mitsuba()
    mi.Bitmap(np.concatenate(views)).convert(
        mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True
    ).write(str(path))


if __name__ == "__main__":
    main()
