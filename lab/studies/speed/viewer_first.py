"""What a page of `nacre view` shows 1, 2 and 8 seconds after it is opened, on SwiftShader.

For windows of a phone, a tablet and a desktop in Chromium: the PSNR of the canvas, as shown,
against the same picture once its filter has faded, beside pairs of directions a pixel. Screenshots
and a sheet of them are written where a folder is named.

Run `python -m lab.studies.speed.viewer_first PAGE --screenshots FOLDER` on a page that `nacre view`
wrote.
"""

from __future__ import annotations

import base64
import io
import math
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.study import Study, log, mean_square
from tests.oracles.runners import browser

WINDOWS = {"phone": (390, 844), "tablet": (1024, 768), "desktop": (1440, 900)}
SECONDS = 1.0, 2.0, 8.0
_QUALITY = 82
_WIDTH, _HEIGHT, _GAP = 1200, 260, 8  # of the sheet of screenshots, in pixels

CANVAS = """() => {
  const { renderer } = window.page ?? {};
  if (!renderer?.frames) return null;
  return [document.getElementById("picture").toDataURL(), renderer.drawn];
}"""
CONVERGED = """async () => {
  const { renderer, mode } = window.page;
  window.page.loop = () => {};
  await new Promise((done) => setTimeout(done, 300));
  while (renderer.frames < 1 || mode.whole) mode.draw();
  renderer.pairs = 8;
  while (renderer.drawn < 256) {
    renderer.frame();
    const fence = renderer.gl.fenceSync(renderer.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    renderer.gl.flush();
    while (renderer.gl.clientWaitSync(fence, 0, 0) === renderer.gl.TIMEOUT_EXPIRED)
      await new Promise((done) => setTimeout(done, 10));
  }
  renderer.present();
  return document.getElementById("picture").toDataURL();
}"""


def pixels(url: str, size: tuple[int, int] | None = None) -> np.ndarray:
    """Display values of a PNG; a sketch is enlarged as the page enlarges it."""
    from PIL import Image

    with Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))) as image:
        whole = image.convert("RGB")
        if size and whole.size != size:
            whole = whole.resize(size, Image.Resampling.BILINEAR)
        return np.asarray(whole, float) / 255.0


def main() -> None:
    """Parse the command line, measure, print."""
    study = Study(__doc__, __file__)
    study.add_argument("page", type=Path, help="a page that nacre view wrote")
    study.add_argument("--screenshots", type=Path, help="folder for screenshots")
    options = study.options()
    windows = {"phone": WINDOWS["phone"]} if options.quick else WINDOWS
    rows = []
    with browser.launched() as chromium:
        for name, size in windows.items():
            found, took = watched(chromium, options.page, size, name, options.screenshots)
            whole = found.pop("converged")[0]
            wanted = pixels(whole)
            row = [f"{name}, {size[0]} x {size[1]}"]
            for seconds in SECONDS:
                url, drawn = found.get(seconds) or ("", 0)
                row.append("nothing yet" if not url else said(url, wanted, drawn))
            log(name, f"{took:.0f} s")
            rows.append(tuple(row))
    study.table(("window", *(f"after {seconds:g} s" for seconds in SECONDS)), rows)
    if options.screenshots:
        sheet(options.screenshots, windows)


def sheet(folder: Path, windows: Iterable[str]) -> None:
    """One picture of all screenshots: windows below each other, seconds from left to right."""
    from PIL import Image

    rows = []
    for name in windows:
        shots = [Image.open(folder / f"viewer-{name}-{seconds:g}.png") for seconds in SECONDS]
        row = Image.new("RGB", (_WIDTH, _HEIGHT), "white")
        for k, shot in enumerate(shots):
            shot.thumbnail((_WIDTH // len(shots) - _GAP, _HEIGHT - _GAP))
            row.paste(shot.convert("RGB"), (k * _WIDTH // len(shots), 0))
        rows.append(row)
    whole = Image.new("RGB", (_WIDTH, _HEIGHT * len(rows)), "white")
    for k, row in enumerate(rows):
        whole.paste(row, (0, k * _HEIGHT))
    whole.save(folder / "viewer-first.jpg", quality=_QUALITY)


def said(url: str, wanted: np.ndarray, drawn: int) -> str:
    error = mean_square(pixels(url, (wanted.shape[1], wanted.shape[0])), wanted)
    return f"{-10.0 * math.log10(error):.1f} dB ({drawn})"


def watched(
    chromium: Any, path: Path, size: tuple[int, int], name: str, folder: Path | None
) -> tuple[dict[Any, Any], float]:
    """Pictures by the seconds since a page was opened, and converged; and how long that took."""
    tab = chromium.new_page(viewport={"width": size[0], "height": size[1]})
    start = time.perf_counter()
    tab.goto(path.resolve().as_uri(), wait_until="commit")
    found: dict[Any, Any] = {}
    for seconds in SECONDS:
        tab.wait_for_timeout(max(1e3 * (start + seconds - time.perf_counter()), 0.0))
        found[seconds] = tab.evaluate(CANVAS)
        if folder:
            folder.mkdir(parents=True, exist_ok=True)
            tab.screenshot(path=folder / f"viewer-{name}-{seconds:g}.png")
    found["converged"] = tab.evaluate(CONVERGED), 0
    tab.close()
    return found, time.perf_counter() - start


if __name__ == "__main__":
    main()
