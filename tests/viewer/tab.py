"""One window of a browser with a page of the viewer."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from nacre.mitsuba.environment import Environment
from nacre.viewer.content import Content, Entry

_SECONDS = 180.0
"""How long a page may take for anything: software draws it, beside other work."""
_ENCODED = """window.encoded = ({ buffer }) => {
  const bytes = new Uint8Array(buffer);
  let text = "";
  for (let k = 0; k < bytes.length; k += 8192)
    text += String.fromCharCode(...bytes.subarray(k, k + 8192));
  return btoa(text);
};"""


def patient(context: Any) -> Any:
    """A context of the browser whose pages may take as long as `until` waits."""
    context.set_default_timeout(1e3 * _SECONDS)
    return context


def wait_for(page: Any, happened: Callable[[], Any], what: str, said: Sequence[str] = ()) -> None:
    """Wait until something has happened in a page.

    Raises
    ------
    TimeoutError
        Saying what, and what was logged until then.
    """
    began = time.monotonic()
    while not happened():
        if time.monotonic() - began > _SECONDS:
            raise TimeoutError(f"{what}; logged: {said}")
        page.wait_for_timeout(20)


def until(page: Any, frame: Any, condition: str, said: Sequence[str] = ()) -> None:
    """Wait until an expression is true in a frame of a page, whose policy may forbid Playwright's
    own waiting.
    """
    wait_for(page, lambda: frame.evaluate(f"Boolean({condition})"), condition, said)


class Tab:
    """A window; leaving it asserts that nothing was logged as an error and nothing left the page.

    Scripts of tests hand over the numbers of a typed array by `window.encoded`, as base64.

    Parameters
    ----------
    browser
        Playwright's.
    folder
        For the page.
    size
        Of the window in pixels, width first.
    settings
        Of Playwright's context: `color_scheme`, `reduced_motion`, ...
    """

    def __init__(
        self, browser: Any, folder: Path, size: tuple[int, int] = (1280, 860), **settings: Any
    ) -> None:
        self._folder = folder
        viewport = {"width": size[0], "height": size[1]}
        self._context = patient(
            browser.new_context(viewport=viewport, accept_downloads=True, **settings)
        )
        self.page = self._context.new_page()
        self.page.add_init_script(_ENCODED)
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", self._logged)
        self.page.on("request", lambda request: self.requests.append(request.url))

    def _logged(self, said: Any) -> None:
        if said.type in ("error", "warning"):
            self.errors.append(said.text)

    def __enter__(self) -> Tab:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._context.close()
        if kind is None:
            assert not self.errors
            assert all(url.startswith(("file:", "blob:", "data:")) for url in self.requests)

    def open(self, content: bytes) -> None:
        """Show a page of the viewer, until its first picture."""
        path = self._folder / "page.html"
        path.write_bytes(content)
        self.page.goto(path.as_uri())
        said = "document.getElementById('trouble')"
        self.wait(f"!{said}.hidden || (window.page && window.page.renderer.frames > 0)")
        assert not self.page.evaluate(f"{said}.textContent")

    def wait(self, condition: str) -> None:
        """Until an expression is true in the page."""
        until(self.page, self.page, condition, self.errors)

    def keep(self, name: str) -> None:
        """A screenshot among the artefacts of the run, if `NACRE_SCREENSHOTS` names a folder."""
        folder = os.environ.get("NACRE_SCREENSHOTS")
        if folder:
            Path(folder).mkdir(parents=True, exist_ok=True)
            self.page.screenshot(path=Path(folder) / f"{name}.png")


def page(
    title: str,
    entries: Sequence[Entry],
    environments: Sequence[Environment],
) -> bytes:
    """A page with materials under environments, as UTF-8; see :class:`Content`."""
    content = Content(environments)
    for entry in entries:
        content.add(entry)
    return content.page(title)
