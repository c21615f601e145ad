"""Networks that see light and view as networks for textures do: Figure 2 of the NBRDF paper.

Rainer, Jakob, Ghosh and Weyrich 2019, "Neural BTF Compression and Interpolation", decode a texel
from a latent code and the stereographic projections of light and view. Of one uniform material the
code is constant, and its part is that of the biases. Each material is fitted by

- nbrdf: the paper's inputs, 675 weights;
- stereographic: the projections, 685 weights, from as many samples and steps;
- with `--wide`, stereographic, 4 x 106: the hidden layers of the 2019 network, 34,877 weights, from
  half the samples and a tenth of the epochs, which still take several times as long.

All minimize the log-cosine loss of the NBRDF paper by nacre's recipe; the 2019 paper has the
squared error of whitened logarithms. Figures are those of `studies.speed.fidelity`. Where a folder
is named, it gets one picture a light: materials from left to right, and from top to bottom the
truth and the fits in the order above.

Run `python -m studies.ablations.stereographic_inputs [FILE...] [--wide] [--pictures FOLDER]`
from the root of the repository; without files, the RGL tables and three published networks.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import nacre
from nacre.color import tone_map
from nacre.metrics import compare
from nacre.neural.fit_data import SAMPLES
from nacre.render.environment import load_environment
from nacre.render.preview import write_bytes
from studies.speed.fidelity import row
from studies.speed.table import markdown
from tests.data import data_folder

NETWORKS = ("chrome", "gold-metallic-paint", "specular-blue-phenolic")


def main() -> None:
    """Print one Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="*", type=Path, help="materials")
    parser.add_argument("--pictures", type=Path, help="folder for a picture under each light")
    parser.add_argument("--wide", action="store_true", help="fit the 4 x 106 network as well")
    options = parser.parse_args()
    data = data_folder()
    if data is None:
        sys.exit("no real measurements: set NACRE_DATA to the folder that holds them")
    environment = load_environment(data / "environment" / "museum.exr")
    networks = [data / "pretrained" / "merl" / f"{name}.h5" for name in NETWORKS]
    files = options.files or [*sorted((data / "rgl").glob("*.bsdf")), *networks]
    recipes = {
        "nbrdf": nacre.Recipe(sampling="rusinkiewicz"),
        "stereographic": nacre.Recipe(
            hidden=(22, 22), inputs="stereographic", samples=SAMPLES, sampling="rusinkiewicz"
        ),
    }
    if options.wide:
        recipes["stereographic, 4 x 106"] = nacre.Recipe(
            hidden=(106,) * 4,
            inputs="stereographic",
            epochs=10,
            samples=SAMPLES // 2,
            learning_rate=3e-3,
            sampling="rusinkiewicz",
        )
    found: dict[str, list[list[float]]] = {name: [] for name in recipes}
    columns: dict[str, list[np.ndarray]] = {}
    rows = []
    for path in files:
        truth = nacre.load(path)
        spheres: dict[str, list[np.ndarray]] = {}
        for name, recipe in recipes.items():
            lights = compare(truth, nacre.fit(truth, recipe), environment=environment).lights
            values = [v for x in lights for v in (x.errors.mae, x.errors.ssim, x.errors.psnr)]
            found[name].append(values)
            rows.append(row(f"{path.stem}, {name}", np.array([[values]])))
            print(*rows[-1], file=sys.stderr, flush=True)
            for item in lights:
                column = spheres.setdefault(item.light, [item.truth])
                column.append(item.other)
        for light, column in spheres.items():
            columns.setdefault(light, []).append(np.concatenate(column))
    for name, values in found.items():
        rows.append(row(f"mean, {name}", np.mean(values, axis=0).tolist()))
    print(markdown(("material", "environment: MAE / SSIM / PSNR", "directional"), rows))
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
        for light, parts in columns.items():
            picture = tone_map(np.concatenate(parts, axis=1))
            drawn = np.round(255 * picture).astype(np.uint8)
            write_bytes(drawn, options.pictures / f"stereographic-{light}.png")


if __name__ == "__main__":
    main()
