"""Rendering speed of textures of measured reflectance beside Mitsuba's textured GGX.

The scene of Rainer et al. 2020, as far as it is described: BTF-mapped cylinders, 800 x 800 pixels,
32 samples per pixel, path-traced. Three cylinders of one texture under an environment. Each way of
rendering has a process of its own, for Dr.Jit compiles all BSDFs of a process into every kernel;
rounds are interleaved, so that a busy machine slows all of them alike. Reported are medians over
rounds of the time, and of the ratios of it and of the processor time of all threads to those of
`roughconductor` with bitmaps of roughness and reflectance in the same round; and the peak of memory
before the first round.

Run `python -m lab.studies.speed.btf_render CODES [MEASURED] [--network CODES] [--custom CODES]`.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import statistics
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

import nacre.mitsuba
from lab.studies.study import Study
from nacre.formats import load_btf
from nacre.mitsuba.preview import render_scene
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.mitsuba.textures.scene import describe_texture_scene, texture_scale
from nacre.textures.latent_map import NeuralBtf

BASELINE = "textured GGX"
_REPEAT = 6
_TEXELS = 256
"""Along the edges of the bitmaps of the baseline."""


@dataclass(frozen=True)
class Way:
    """A way to render the texture.

    Parameters
    ----------
    name
        To report.
    path
        Of the texture; the baseline's bitmaps where empty.
    options
        Of :func:`nacre.mitsuba.textures.plugins.texture_bsdf`.
    """

    name: str
    path: str
    options: dict[str, Any]


def ways(options: argparse.Namespace) -> list[Way]:
    """All that are compared."""
    table: dict[str, Any] = {"decoder": "table"}
    network: dict[str, Any] = {"decoder": "network"}
    linear = {"interpolation": "linear"}
    found = [Way(BASELINE, "", {}), Way("default codec, table", options.codes, table)]
    if not options.quick:
        found += [
            Way("default codec, table, 16 nodes", options.codes, table | {"resolution": 16}),
            Way("default codec, table, linear", options.codes, table | linear),
            Way("default codec, networks", options.codes, network),
            Way(
                "default codec, networks, coefficients at hits",
                options.codes,
                network | {"coefficients": "hit"},
            ),
            Way("default codec, networks, half", options.codes, network | {"precision": "half"}),
        ]
    for name, path in (("2020", options.network), ("2019", options.custom)):
        if path:
            found += [
                Way(f"decoder of {name}, table", path, table),
                Way(f"decoder of {name}, network", path, network),
                Way(f"decoder of {name}, network, half", path, network | {"precision": "half"}),
            ]
    if options.measured:
        found += [
            Way("measured, interpolated", options.measured, linear),
            Way("measured, stochastic", options.measured, {}),
        ]
    return found


def baseline(mi: Any, to_uv: Any) -> Any:
    """A rough conductor with a bitmap of roughness and one of reflectance."""
    random = np.random.default_rng(0)

    def bitmap(channels: int, low: float, high: float) -> dict[str, Any]:
        pixels = random.uniform(low, high, (_TEXELS, _TEXELS, channels)).astype(np.float32)
        return {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(pixels), "to_uv": to_uv}

    return {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha": bitmap(1, 0.15, 0.4),
        "specular_reflectance": bitmap(3, 0.1, 0.9),
    }


def scene(mi: Any, bsdf: Any, size: int) -> Any:
    """Three cylinders of one material."""
    described = describe_texture_scene(bsdf, "cylinder", size=(size, size))
    bsdf = mi.load_dict(bsdf) if isinstance(bsdf, dict) else bsdf
    for name in ("object", "lid"):
        described.pop(name)
    for index, x in enumerate((-0.95, 0.0, 0.95)):
        described[f"cylinder_{index}"] = {
            "type": "cylinder",
            "p0": [x, 0.0, 0.0],
            "p1": [x, 2.3, 0.0],
            "radius": 0.44,
            "bsdf": bsdf,
        }
    return mi.load_dict(described)


def serve(way: Way, size: int, spp: int, threads: int, pipe: Any) -> None:
    """Render whenever asked, and report how long it took."""
    mi = nacre.mitsuba.mitsuba()
    import drjit as dr

    dr.set_thread_count(threads)
    to_uv = texture_scale("cylinder", _REPEAT)
    start = time.perf_counter()
    if way.path:
        source = load_btf(way.path)
        made = source.latent if isinstance(source, NeuralBtf) else source
        bsdf = texture_bsdf(made, to_uv=to_uv, **way.options)
    else:
        bsdf = baseline(mi, to_uv)
    prepared = time.perf_counter() - start
    loaded = scene(mi, bsdf, size)
    start = time.perf_counter()
    render_scene(loaded, 1)
    compiled = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
    pipe.send((prepared, compiled, peak))
    while (seed := pipe.recv()) is not None:
        wall, used = time.perf_counter(), time.process_time()
        render_scene(loaded, spp, seed)
        pipe.send((time.perf_counter() - wall, time.process_time() - used))


def measure(found: list[Way], options: argparse.Namespace) -> list[tuple[str, ...]]:
    """Lines of the table."""
    context = multiprocessing.get_context("spawn")
    pipes, facts, times = [], [], [[] for _ in found]
    for way in found:
        pipe, child = context.Pipe()
        arguments = (way, options.size, options.spp, options.threads, child)
        context.Process(target=serve, args=arguments, daemon=True).start()
        child.close()
        facts.append(pipe.recv())
        pipes.append(pipe)
    for seed in range(options.rounds + 1):
        for pipe, own in zip(pipes, times, strict=True):
            pipe.send(seed)
            own.append(pipe.recv())
    for pipe in pipes:
        pipe.send(None)
    lines = []
    samples = options.size**2 * options.spp / 1e6
    base = np.array(times[0][1:])  # the first round wakes the threads
    for way, (prepared, compiled, peak), own in zip(found, facts, times, strict=True):
        ratios = np.array(own[1:]) / base
        seconds = statistics.median(wall for wall, _ in own[1:])
        lines.append(
            (
                way.name,
                f"{prepared:.1f}",
                f"{compiled:.1f}",
                f"{seconds:.2f}",
                f"{samples / seconds:.2f}",
                f"{np.median(ratios[:, 0]):.2f}",
                f"{np.median(ratios[:, 1]):.2f}",
                f"{peak:.0f}",
            )
        )
    return lines


def main() -> None:
    """Parse the command line, measure, print."""
    study = Study(__doc__, __file__)
    study.add_argument("codes", help="texture encoded by the default codec")
    study.add_argument("measured", nargs="?", help="the texture itself")
    study.add_argument("--network", help="texture encoded by a network of 2020")
    study.add_argument("--custom", help="texture encoded by a network of 2019")
    study.add_argument("--rounds", type=int, default=5)
    study.add_argument("--size", type=int, default=800, help="pixels a side")
    study.add_argument("--spp", type=int, default=32, help="samples per pixel")
    study.add_argument("--threads", type=int, default=multiprocessing.cpu_count())
    options = study.options()
    columns = (
        "", "made, s", "compiled, s", "rendered, s", "M samples/s",
        "time over GGX", "processor time over GGX", "peak MiB",
    )  # fmt: skip
    study.table(columns, measure(ways(options), options))


if __name__ == "__main__":
    main()
