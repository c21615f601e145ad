"""How close fits come to real RGL tables, and how close the published networks do.

Protocol: the deterministic sphere of :mod:`nacre.render.sphere`, 128 x 128, under an environment
map and a directional light. `python -m benchmarks.fidelity [FOLDER for pictures]`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import nacre
from benchmarks.table import markdown
from nacre.brdf import Brdf
from nacre.evaluate import compare, picture
from nacre.render.environment import Environment, load_environment
from nacre.render.preview import write_bytes
from tests.data import data_folder


def figures(truth: Brdf, other: Brdf, environment: Environment) -> list[float]:
    """MAE, SSIM and PSNR under the environment, then under the directional light."""
    lights = compare(truth, other, environment=environment).lights
    return [value for x in lights for value in (x.errors.mae, x.errors.ssim, x.errors.psnr)]


def row(name: str, values: list[float]) -> tuple[str, ...]:
    """One line of the table."""
    triples = values[:3], values[3:]
    return name, *(f"{mae:.4f} / {ssim:.4f} / {psnr:.1f}" for mae, ssim, psnr in triples)


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="where a picture of each fit goes")
    options = parser.parse_args()
    data = data_folder()
    if data is None:
        sys.exit("no real measurements: set NACRE_DATA to the folder that holds them")
    environment = load_environment(data / "environment" / "museum.exr")
    rows: list[tuple[str, ...]] = []
    sums: dict[str, list[list[float]]] = {"nacre": [], "published": []}
    for path in sorted((data / "rgl").glob("*.bsdf")):
        truth = nacre.load(path)
        network = nacre.fit(truth)
        published = nacre.load(data / "pretrained" / "rgl" / f"{path.stem}.h5")
        for kind, other in (("nacre", network), ("published", published)):
            sums[kind].append(figures(truth, other, environment))
            rows.append(row(f"{path.stem}, {kind}", sums[kind][-1]))
            print(*rows[-1], file=sys.stderr, flush=True)
        if options.folder:
            options.folder.mkdir(parents=True, exist_ok=True)
            drawn = picture(compare(truth, network, environment=environment))
            write_bytes(drawn, options.folder / f"{path.stem}.png")
    for kind, values in sums.items():
        rows.append(row(f"mean, {kind}", np.mean(values, axis=0).tolist()))
    print(markdown(("675 weights", "environment: MAE / SSIM / PSNR", "directional"), rows))


if __name__ == "__main__":
    main()
