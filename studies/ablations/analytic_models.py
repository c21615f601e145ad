"""How close each analytic model comes to measured tables, and how long its fit takes.

Printed is the loss of the NBRDF paper (mean |log(1 + f cos) - log(1 + g cos)| over pairs uniform in
the Rusinkiewicz angles), its mean and largest value over the files, bytes a material, and seconds
a fit. With `--pictures` also PSNR and SSIM of spheres, as `nacre compare` has them, means over the
files; an RGL table of 48 KB is the last row.

Run `python experiments/analytic_models.py FILE...`.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial

import numpy as np

import nacre
from nacre.analytic import MODELS, fit
from nacre.brdf import Brdf
from nacre.measured import rgl
from nacre.measured.rgl_writer import COMPACT
from nacre.metrics import angular_errors, compare


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="+", help="any materials")
    parser.add_argument("--gain", type=float, default=1.0, help="gain of the loss")
    parser.add_argument("--models", default=",".join(MODELS), help="names, with commas between")
    parser.add_argument("--pictures", action="store_true", help="compare spheres too")
    options = parser.parse_args()
    materials = [nacre.load(path) for path in options.files]
    rows: dict[str, Callable[[Brdf], Brdf]] = {
        name: partial(fit, model=MODELS[name], gain=options.gain)
        for name in options.models.split(",")
    }
    head = ["model", "bytes", "mean loss", "largest", "s a fit"]
    if options.pictures:
        rows["RGL table"] = partial(rgl.tabulate, resolution=COMPACT)
        head += ["PSNR, environment", "SSIM", "PSNR, directional", "SSIM"]
    print(f"| {' | '.join(head)} |\n|---{'|---:' * (len(head) - 1)}|")
    for name, make in rows.items():
        start = time.perf_counter()
        fits = [make(material) for material in materials]
        seconds = (time.perf_counter() - start) / len(fits)
        pairs = list(zip(materials, fits, strict=True))
        losses = [angular_errors(*pair).log_cosine for pair in pairs]
        cells = [
            name,
            str(fits[0].nbytes),
            f"{np.mean(losses):.4f}",
            f"{max(losses):.4f}",
            f"{seconds:.1f}",
        ]
        if options.pictures:
            errors = [[light.errors for light in compare(*pair).lights] for pair in pairs]
            for light in zip(*errors, strict=True):
                cells += [
                    f"{np.mean([e.psnr for e in light]):.1f} dB",
                    f"{np.mean([e.ssim for e in light]):.3f}",
                ]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
