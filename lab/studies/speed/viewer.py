"""Pages of `nacre view`: bytes, first pictures, frames and convergence, in Chromium on SwiftShader.

Each page is opened anew every round. Frames are those of a sphere without a stage. A picture counts
as converged at the frame where the page says so; its PSNR, as shown, is against one of eight times
as many frames.

Run `python -m lab.studies.speed.viewer PAGE...` on pages that `nacre view` wrote.
"""

from __future__ import annotations

import math
import statistics
import time
from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.study import Study, log, mean_square
from nacre.color import tone_map
from nacre.errors import NacreError
from tests.oracles.runners import browser

CONVERGED, MORE = 64, 8
_SECONDS = 120.0

FRAMES = """async (count) => {
  const { renderer } = window.page, { gl } = renderer, times = [], pixel = new Uint8Array(4);
  window.page.loop = () => {};
  await new Promise((done) => setTimeout(done, 300));
  renderer.change({ stage: false, film: false, shape: "sphere" });
  renderer.restart();
  for (let k = 0; k < count; k++) {
    const start = performance.now();
    renderer.frame();
    renderer.present();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits for the frame
    times.push(performance.now() - start);
  }
  return times;
}"""
SUMS = "() => [...window.page.renderer.sums()]"


def opened(chromium: Any, path: Path, size: tuple[int, int]) -> tuple[Any, float]:
    """A tab with a page, and the seconds until its first picture."""
    page = chromium.new_page(viewport={"width": size[0], "height": size[1]})
    start = time.perf_counter()
    page.goto(path.resolve().as_uri())
    while not page.evaluate("Boolean(document.getElementById('status').textContent)"):
        if time.perf_counter() - start > _SECONDS:
            raise NacreError(f"{path}: shows no picture")
        time.sleep(0.005)
    return page, time.perf_counter() - start


def picture(page: Any) -> np.ndarray:
    """What is shown, over black, shape (pixels, 3)."""
    sums = np.float32(page.evaluate(SUMS)).reshape(-1, 4)
    return np.asarray(tone_map(sums[:, :3] / sums[:, 3].max()))


def main() -> None:
    """Parse the command line, measure, print."""
    study = Study(__doc__, __file__)
    study.add_argument("pages", nargs="+", type=Path, help="pages that nacre view wrote")
    study.add_argument("--rounds", type=int, default=5)
    study.add_argument("--size", type=int, default=512, help="pixels along an edge of the picture")
    options = study.options()
    rounds, frames = (1, 4) if options.quick else (options.rounds, CONVERGED)
    rows = []
    with browser.launched() as chromium:
        for path in options.pages:
            first = []
            for _ in range(rounds):
                page, seconds = opened(chromium, path, (1280, 860))
                first.append(seconds)
                page.close()
            page, _ = opened(chromium, path, (1280, 860))
            page.evaluate(f"() => window.page.renderer.resize({options.size}, {options.size})")
            times = page.evaluate(FRAMES, frames)
            found = picture(page)
            page.evaluate(FRAMES, MORE * frames)
            psnr = -10.0 * math.log10(mean_square(found, picture(page)))
            page.close()
            log(path.name, f"{sum(times) / 1e3:.1f} s")
            rows.append(
                (
                    path.name,
                    f"{path.stat().st_size:,}",
                    f"{statistics.median(first):.2f}",
                    f"{statistics.median(times):.0f}",
                    f"{sum(times) / 1e3:.1f}",
                    f"{psnr:.1f}",
                )
            )
    columns = "bytes", "first picture (s)", "frame (ms)", "converged (s)", "PSNR (dB)"
    study.table(("page", *columns), rows)


if __name__ == "__main__":
    main()
