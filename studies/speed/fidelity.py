"""How close fits come to real RGL tables, and how close the published networks do.

Protocol: the deterministic sphere of :mod:`nacre.render.sphere`, 128 x 128, under an environment
map and a directional light. `python -m studies.speed.fidelity [FOLDER for pictures]`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import nacre
from nacre.brdf import Brdf
from nacre.figures import picture
from nacre.metrics import compare
from nacre.render.environment import Environment, load_environment
from nacre.render.preview import write_bytes
from studies.speed.table import markdown
from tests.data import data_folder

METHODS = {
    "paper's inputs and directions, 675 weights": nacre.Recipe(sampling="rusinkiewicz"),
    "paper's inputs, 675 weights": nacre.Recipe(),
    "enhanced inputs, 675 weights": nacre.Recipe(inputs="enhanced"),
    "enhanced inputs, 675 weights, 300 epochs": nacre.Recipe(inputs="enhanced", epochs=300),
    "enhanced inputs, 298 weights, 300 epochs": nacre.Recipe(
        inputs="enhanced", hidden=(13, 12), epochs=300
    ),
    "enhanced inputs, 1,200 bytes": nacre.Recipe(inputs="enhanced", size=1200),
}
"""Recipes that are compared with the published networks."""


def figures(truth: Brdf, other: Brdf, environment: Environment) -> list[float]:
    """MAE, SSIM and PSNR under the environment, then under the directional light."""
    lights = compare(truth, other, environment=environment).lights
    return [value for x in lights for value in (x.errors.mae, x.errors.ssim, x.errors.psnr)]


def row(name: str, values: np.ndarray) -> tuple[str, ...]:
    """One line of the table: means over materials and seeds, then the worst material's PSNR."""
    mean, worst = values.mean(axis=(0, 1)), values.mean(axis=1).min(axis=0)
    cells = (
        f"{mae:.4f} / {ssim:.4f} / {psnr:.1f} ({low:.1f})"
        for mae, ssim, psnr, low in ((*mean[:3], worst[2]), (*mean[3:], worst[5]))
    )
    return name, *cells


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="where a picture of each fit goes")
    parser.add_argument("--seeds", type=int, default=3, help="fits of each material")
    options = parser.parse_args()
    data = data_folder()
    if data is None:
        sys.exit("no real measurements: set NACRE_DATA to the folder that holds them")
    environment = load_environment(data / "environment" / "museum.exr")
    found: dict[str, list[list[list[float]]]] = {name: [] for name in ("published", *METHODS)}
    for path in sorted((data / "rgl").glob("*.bsdf")):
        truth = nacre.load(path)
        published = nacre.load(data / "pretrained" / "rgl" / f"{path.stem}.h5")
        found["published"].append([figures(truth, published, environment)])
        for name, recipe in METHODS.items():
            fits = [nacre.fit(truth, replace(recipe, seed=k)) for k in range(options.seeds)]
            found[name].append([figures(truth, fit, environment) for fit in fits])
            if options.folder:
                options.folder.mkdir(parents=True, exist_ok=True)
                drawn = picture(compare(truth, fits[0], environment=environment))
                write_bytes(drawn, options.folder / f"{path.stem} {name}.png")
        for name, values in found.items():
            one = np.array(values[-1:])
            print(*row(f"{path.stem}, {name}", one), file=sys.stderr, flush=True)
    rows = [row(name, np.array(values)) for name, values in found.items()]
    head = ("mean of all; worst PSNR", "environment: MAE / SSIM / PSNR", "directional")
    print(markdown(head, rows))


if __name__ == "__main__":
    main()
