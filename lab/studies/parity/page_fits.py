"""Networks that the viewer's page fits, against those of `nacre fit`: seconds and picture errors.

Files are dropped on a page in Chromium, whose shaders SwiftShader runs on the processor, and the
button is pressed: seconds are from there to the network on the picture. The same steps by the
page's kernel, compiled natively without AVX, are timed in training alone. PSNR is that of `nacre
compare` between file and network, in the environment and in directional light.

`python -m lab.studies.parity.page_fits [FILE...]` takes the RGL tables, a MERL table and a scan
that it makes where no file is given. `--quick` makes drafts only.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import nacre
from lab.studies.study import Study, log, museum, rgl_tables
from nacre.analytic import Ggx
from nacre.brdf import Brdf
from nacre.formats import save
from nacre.metrics import compare
from nacre.mitsuba.studio import studio
from nacre.neural import fitting, replicas
from nacre.neural.recipe import Recipe
from nacre.viewer.content import Content, Entry
from nacre.viewer.fits import PRESETS
from tests.oracles.kernel import NativeTrainer
from tests.oracles.runners import browser
from tests.viewer.fitting import drop, fit, saved
from tests.viewer.tab import Tab

NOTE = (
    "Means over seeds, ± standard deviations; trainings that add in another order go another way, "
    "as with another seed."
)
MERL = "gold-metallic-paint"


def files(folder: Path) -> list[Path]:
    """The RGL tables, and a MERL table and a scan of published materials."""
    gold = nacre.load(f"merl:{MERL}")
    table, scan = folder / f"{MERL}.binary", folder / f"{MERL}.csv"
    for path in (table, scan):
        save(gold, path)
    return [*rgl_tables(), table, scan]


@contextmanager
def native() -> Iterator[None]:
    """Training by the page's kernel."""
    with mock.patch.object(replicas, "KernelTrainer", NativeTrainer):
        yield


def trained(brdf: Brdf, preset: str, seed: int) -> tuple[Brdf, float]:
    """A fit, and the seconds of its training."""
    times: list[float] = []

    def watch(stage: str, done: int, total: int, note: str) -> None:
        if stage in ("sampling", "training"):
            times.append(time.perf_counter() if stage == "training" or done >= total else 0.0)

    network = fitting.fit(brdf, Recipe.preset(preset, seed=seed), progress=watch)
    return network, times[-1] - next(t for t in times if t)


def psnr(truth: Brdf, network: Brdf, environment: Any) -> list[float]:
    return [x.errors.psnr for x in compare(truth, network, environment=environment).lights]


def main() -> None:
    """Parse the command line, measure, print."""
    study = Study(__doc__, __file__)
    study.add_argument("files", nargs="*", type=Path, help="measured files")
    study.add_argument("--seeds", type=int, default=1, help="fits of each, with further seeds")
    study.add_argument("--size", type=int, default=512, help="pixels along an edge of the picture")
    options = study.options()
    environment = museum()
    rows = []
    with tempfile.TemporaryDirectory() as name, browser.launched() as chromium:
        folder = Path(name)
        content = Content([studio()])
        plastic = Ggx(diffuse=(0.8,) * 3, specular=(0.04,) * 3, roughness=0.3)
        content.add(Entry("Plastic", {"Formula": plastic}))
        shown = content.page("Fits")
        for path in options.files or files(folder):
            brdf = nacre.load(path)
            for preset in study.few(PRESETS, 1):
                times, found = [], []
                for seed in range(options.seed, options.seed + options.seeds):
                    with Tab(chromium, folder) as tab:
                        tab.open(shown)
                        drop(tab, path, options.size)
                        tab.page.evaluate(f"window.page.facts.fit.presets.{preset}.seed = {seed}")
                        seconds = fit(tab, preset)
                        ours = nacre.load(saved(tab, folder / "network.safetensors"))
                    theirs, own = trained(brdf, preset, seed)
                    with native():
                        _, plain = trained(brdf, preset, seed)
                    times.append((seconds, plain, own))
                    found.append([psnr(brdf, x, environment) for x in (ours, theirs)])
                    log(path.name, preset, seed, *times[-1], *found[-1])
                rows.append(row(path.name.removesuffix("_rgb.bsdf"), preset, times, found))
    columns = (
        *("material", "fit", "page (s)", "kernel, native (s)", "nacre's kernel (s)"),
        *("environment: page / nacre (dB)", "directional", "gained"),
    )
    study.table(columns, rows, note=NOTE)


def row(name: str, preset: str, times: Any, found: Any) -> tuple[str, ...]:
    """Medians of times, means of errors (seeds, page or nacre, lights)."""
    means, spread = np.mean(found, axis=0), np.std(found, axis=0, ddof=min(1, len(found) - 1))
    ours, theirs = (
        [f"{mean:.1f} ± {own:.1f}" for mean, own in zip(*pair, strict=True)]
        for pair in zip(means, spread, strict=True)
    )
    pairs = [f"{a} / {b}" for a, b in zip(ours, theirs, strict=True)]
    gained = [f"{a - b:+.1f}" for a, b in zip(*means, strict=True)]
    seconds = (f"{x:.1f}" for x in np.median(times, axis=0))
    return name, preset, *seconds, *pairs, ", ".join(gained)


if __name__ == "__main__":
    main()
