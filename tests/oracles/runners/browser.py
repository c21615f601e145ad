"""Chromium without a window: scripts run in its pages, and nothing reaches a network."""

from __future__ import annotations

import asyncio
import atexit
import base64
import importlib.util
import shutil
import tempfile
import threading
from collections.abc import Callable, Coroutine, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlparse

import numpy as np

from nacre.array import Weights

if TYPE_CHECKING:
    from playwright.async_api import Browser, Route
    from playwright.sync_api import Browser as SyncBrowser

_SITE = "https://page.invalid/"
_NAMES = "chromium", "chromium-browser", "google-chrome"
FLAGS = (
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"),
    "--disable-gpu-watchdog",
)
"""SwiftShader for both interfaces, on every machine; its frames may take longer than a card's."""
_SECONDS = 300.0
"""How long a script may take."""
_TYPES = {".html": "text/html", ".js": "text/javascript"}
_PAGE = b"<!doctype html><title>page</title><input type=file multiple hidden>"
_CALL = "async ([path, name, argument]) => (await import(path))[name](argument)"
_Value = TypeVar("_Value")


def missing() -> str | None:
    """What pages need and this machine does not have."""
    if importlib.util.find_spec("playwright") is None:
        return "Python's playwright"
    return None if program() else "chromium"


def scripts(*names: str) -> dict[str, bytes | Path]:
    """Files of this folder."""
    return {name: (Path(__file__).parent / name).read_bytes() for name in names}


def floats(text: str) -> Weights:
    """Numbers of a `Float32Array` that `shared.js` encoded."""
    return np.frombuffer(base64.b64decode(text), "<f4")


def compute(
    files: Mapping[str, bytes | Path],
    path: str,
    function: str,
    argument: object = None,
    data: Mapping[str, Weights] | None = None,
    *,
    size: tuple[int, int] = (800, 600),
    screenshot: Path | None = None,
) -> Any:
    """The result of a function of a module, in a page of its own.

    Parameters
    ----------
    files
        What the page sees, by path, and it sees nothing else; a folder stands for all that it
        holds. An `index.html` takes the place of an empty page.
    path, function, argument
        The module, what it exports, and what that is called with (as JSON).
    data
        Arrays that `shared.js` reads. They reach the browser as files: as answers to requests a
        million vectors take seconds.
    size
        Of the window in pixels, width first.
    screenshot
        Where to leave a picture of the window, as PNG, once the function is done.

    Raises
    ------
    RuntimeError
        With the message of what the function throws, or what the page logs as errors; or if it
        takes more than five minutes.
    """

    async def work() -> Any:
        browser = await _browser()
        page = await browser.new_page(viewport={"width": size[0], "height": size[1]})
        errors: list[str] = []
        page.on("console", lambda said: errors.append(said.text) if said.type == "error" else None)
        try:
            await page.route("**/*", _answers({"index.html": _PAGE, **files}))
            await page.goto(_SITE)
            if data:
                await page.set_input_files("input", [Path(folder) / name for name in data])
            result = await page.evaluate(_CALL, [f"/{path}", function, argument])
            if errors:
                raise RuntimeError("\n".join(errors))
            if screenshot:
                await page.screenshot(path=screenshot, timeout=1e3 * _SECONDS)
            return result
        finally:
            await page.close()

    with tempfile.TemporaryDirectory() as folder:
        for name, values in (data or {}).items():
            values.astype("<f4").tofile(Path(folder) / name)
        return _wait(work())


def program() -> str | None:
    """Path of Chromium, where there is one."""
    return next(filter(None, map(shutil.which, _NAMES)), None)


@cache
def _loop() -> asyncio.AbstractEventLoop:
    """Runs beside this thread, which may have a loop of its own."""
    loop = asyncio.new_event_loop()
    threading.Thread(target=loop.run_forever, daemon=True).start()
    return loop


def _wait(work: Coroutine[Any, Any, _Value]) -> _Value:
    from playwright.async_api import Error

    limited = asyncio.wait_for(work, _SECONDS)
    try:
        return asyncio.run_coroutine_threadsafe(limited, _loop()).result()
    except TimeoutError as error:
        raise RuntimeError(f"the page takes more than {_SECONDS:.0f} s") from error
    except Error as error:
        text = str(error).removeprefix("Page.evaluate: ").removeprefix("Error: ")
        lines = [line for line in text.splitlines() if not line.lstrip().startswith("at ")]
        raise RuntimeError("\n".join(lines[:20]).strip()) from error


_open: list[Browser] = []


@contextmanager
def launched() -> Iterator[SyncBrowser]:
    """A browser of its own for pages that are used step by step."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program(), args=FLAGS)
        yield browser
        browser.close()


async def _browser() -> Browser:
    """The browser of this process; it is closed at its end."""
    from playwright.async_api import async_playwright

    if _open and _open[0].is_connected():
        return _open[0]
    driver = await async_playwright().start()
    browser = await driver.chromium.launch(executable_path=program(), args=list(FLAGS))

    async def close() -> None:
        await browser.close()
        await driver.stop()

    atexit.register(lambda: _wait(close()))
    _open[:] = [browser]
    return browser


def _answers(files: Mapping[str, bytes | Path]) -> Callable[[Route], Coroutine[Any, Any, None]]:
    async def answer(route: Route) -> None:
        url = route.request.url
        path = urlparse(url).path.lstrip("/") or "index.html"
        body = _find(files, path) if url.startswith(_SITE) else None
        if body is None:
            await route.fulfill(status=404)
        else:
            kind = _TYPES.get(Path(path).suffix, "application/octet-stream")
            await route.fulfill(body=body, content_type=kind)

    return answer


def _find(files: Mapping[str, bytes | Path], path: str) -> bytes | None:
    if isinstance(body := files.get(path), bytes):
        return body
    for name, folder in files.items():
        if isinstance(folder, Path) and path.startswith(f"{name}/"):
            file = folder / path.removeprefix(f"{name}/")
            return file.read_bytes() if file.is_file() else None
    return None
