"""Memory and time of commands on large encoded textures.

Codes of a small encoded texture are repeated with some noise, as the 32 values of a texel and as
128 coefficients, and written in 8 bytes per texel; the commands that textures are used with then
run on these files. Each is a process of its own; the system tells its largest resident memory, and
the time of all cores.

`python -m lab.studies.speed.large_textures CODES.safetensors -o OUT`, with a texture that
`nacre fit` wrote. Files of an earlier run are kept in OUT.
"""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from lab.studies.study import Study, log
from nacre.textures.latent_file import load_latent_map, save_latent_map
from nacre.textures.latent_map import LatentMap

NOISE = 0.02  # of the standard deviation of each value
BYTES = "8"


def enlarged(latent: LatentMap, edge: int) -> LatentMap:
    """`edge` x `edge` codes: those of a map again and again, no two alike."""
    height, width, _ = latent.shape
    rows, columns = np.arange(edge) % height, np.arange(edge) % width
    codes = latent.codes[np.ix_(rows, columns)].astype(np.float32)
    scale = (NOISE * latent.codes.std((0, 1))).astype(np.float32)
    random = np.random.default_rng(0)
    for row in codes:
        row += scale * random.standard_normal(row.shape, np.float32)
    return replace(latent, codes=codes)


def write(latent: LatentMap, edge: int, path: Path) -> None:
    save_latent_map(enlarged(latent, edge), path)


def measured(*arguments: str) -> tuple[float, float]:
    """Seconds of all cores that a command takes, and gigabytes in memory at most."""
    process = subprocess.Popen(
        [sys.executable, "-m", "nacre", *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    assert process.stderr is not None
    said = process.stderr.read().decode()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"nacre {' '.join(arguments)}: {said[-500:]}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 2**20


def uses(path: Path, other: Path, folder: Path) -> dict[str, tuple[str, ...]]:
    """Commands on a large texture, by their names in the table."""
    file = str(path)
    three = "--to", "three", "--bytes-per-texel", BYTES
    return {
        "info": ("info", file),
        "compare": ("compare", str(other), file, "--pairs", "50", "--force"),
        "export --to three": ("export", file, *three, "-o", str(folder / "three"), "--force"),
        "btf mipmap": ("btf", "mipmap", file, "--force"),
        "render": (
            "render",
            file,
            "--spp",
            "4",
            "--size",
            "256",
            "-o",
            str(folder / "a.png"),
            "--force",
        ),
    }


def main() -> None:
    """Print Markdown tables."""
    study = Study(__doc__, __file__)
    study.add_argument("codes", type=Path)
    study.add_argument("--edges", type=int, nargs="+", default=[256, 512, 1024])
    options = study.options()
    short = load_latent_map(options.codes)
    print("| values per texel | texels | seconds | per texel, relative | GB |")
    print("|---:|---:|---:|---:|---:|")
    for latent in (short, short.expanded()):
        if latent is None:
            continue
        size, first = latent.codec.code_dim, None
        for edge in options.edges:
            before = study.output / f"{size}_{edge}.safetensors"
            after = before.with_name(f"{before.stem}_rated.safetensors")
            if not before.exists():  # a child begins with the memory of this process
                with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                    pool.submit(write, latent, edge, before).result()
            recode = "btf", "recode", str(before), "--bytes-per-texel", BYTES, "-o", str(after)
            seconds, memory = measured(*recode, "--force")
            first = first or seconds / edge**2
            ratio = seconds / edge**2 / first
            print(f"| {size} | {edge} x {edge} | {seconds:.0f} | {ratio:.2f} | {memory:.2f} |")
        print("\n| command | seconds | GB |\n|---|---:|---:|")
        for name, arguments in uses(after, before, study.output).items():
            seconds, memory = measured(*arguments)
            log(arguments)
            print(f"| {name} | {seconds:.0f} | {memory:.2f} |", flush=True)
        print()


if __name__ == "__main__":
    main()
