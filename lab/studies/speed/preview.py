"""Previews of `nacre render`: seconds of the whole command, and the error of what it shows.

Each material is rendered by the command as it comes, by `--no-denoise`, and with many samples as
the truth. PSNR is of pictures as they are shown.

Run `python -m lab.studies.speed.preview MATERIAL...`.
"""

from __future__ import annotations

import math
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.study import Study, log, mean_square
from nacre.color import tone_map
from nacre.mitsuba import mitsuba

WAYS = {"default": (), "--no-denoise": ("--no-denoise",)}


def render(material: str, output: Path, *options: object) -> tuple[float, Any]:
    """Seconds that the command took, and the picture as it is shown."""
    words = ["render", material, "-o", output, "--force", *options]
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "nacre", "-q", *map(str, words)], check=True)
    seconds = time.perf_counter() - start
    return seconds, tone_map(np.array(mitsuba().Bitmap(str(output))))


def main() -> None:
    """Parse the command line, measure, print."""
    study = Study(__doc__, __file__)
    study.add_argument("materials", nargs="+", help="files that nacre render takes")
    study.add_argument("--rounds", type=int, default=3)
    study.add_argument("--spp", type=int, default=1024, help="samples per pixel of the truth")
    options = study.options()
    size = ("--size", 64) if options.quick else ()
    rows = []
    for material in options.materials:
        name = Path(material).stem
        output = study.output / f"{name}.exr"
        many = ("--no-denoise", "--spp", options.spp, "--seed", options.seed + 1)
        _, truth = render(material, output, *many, *size)
        for way, chosen in WAYS.items():
            log(name, way)
            runs = [render(material, output, *chosen, *size) for _ in range(options.rounds)]
            seconds = statistics.median(seconds for seconds, _ in runs)
            psnr = -10.0 * math.log10(mean_square(runs[0][1], truth))
            rows.append((name, way, f"{seconds:.1f}", f"{psnr:.1f}"))
    study.table(("material", "nacre render", "seconds", "PSNR (dB)"), rows)


if __name__ == "__main__":
    main()
