"""Textures on pages of `nacre view`: milliseconds of a frame under a lamp that moves, in Chromium.

Of each surface, near and far, with SwiftShader; a frame is waited for before the next begins.

Run `python -m lab.studies.speed.viewer_textures PAGE...` on pages that `nacre view` wrote.
"""

from __future__ import annotations

import statistics
from pathlib import Path

from lab.studies.speed.viewer import opened
from lab.studies.study import Study
from tests.oracles.runners import browser

SURFACES = "plane", "cylinder", "cloth"
NEAR, FAR = 1, 8
"""Repeats of the texture: texels are larger than pixels, or levels of the mipmap are mixed."""

FRAMES = """async ([shape, repeats, size, count]) => {
  const { page } = window, { renderer, controls } = page, { gl } = renderer, times = [];
  page.loop = () => {};
  await new Promise((done) => setTimeout(done, 300));
  page.open(page.modes.find((mode) => mode.title === "Textures"));
  page.mode.follow("still");
  renderer.resize(size, size);
  page.mode.textured.change({ shape, repeats });
  const pixel = new Uint8Array(4);
  for (let k = 0; k <= count; k++) {
    const start = performance.now();
    controls.move(0.6 * Math.sin(k), 0.6 * Math.cos(k));
    page.mode.draw();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits for the frame
    times.push(performance.now() - start);
  }
  return times.slice(1); // the first one compiles
}"""


def main() -> None:
    """Parse the command line, measure, print."""
    study = Study(__doc__, __file__)
    study.add_argument("pages", nargs="+", type=Path, help="pages that nacre view wrote")
    study.add_argument("--frames", type=int, default=20)
    study.add_argument("--size", type=int, default=512, help="pixels along an edge of the picture")
    options = study.options()
    frames = 3 if options.quick else options.frames
    rows = []
    with browser.launched() as chromium:
        for path in options.pages:
            page, _ = opened(chromium, path, (1280, 860))
            for surface in SURFACES:
                times = [
                    statistics.median(
                        page.evaluate(FRAMES, [surface, repeats, options.size, frames])
                    )
                    for repeats in (NEAR, FAR)
                ]
                rows.append((path.name, surface, *(f"{time:.0f}" for time in times)))
            page.close()
    columns = f"repeats {NEAR} (ms)", f"repeats {FAR} (ms)"
    study.table(("page", "surface", *columns), rows)


if __name__ == "__main__":
    main()
