"""The pages whose lines are typed, what they need, and typing one in an empty folder."""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
import tempfile
import threading
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import IO, Any

from tests.data import data_folder

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "docs/start.md", *sorted((ROOT / "docs/guide").glob("*.md"))]
_HERE = Path(__file__).parent


def extras(page: Path) -> list[str]:
    """`render`, which the pages take as installed, and the extras that a page names."""
    words = " ".join(page.read_text("utf-8").split())
    lists = re.findall(r"\bextras? ((?:`[a-z]+`(?:, | and )?)+)", words)
    return sorted(
        {"render", *(name for each in lists for name in re.findall(r"\w+", each))} - {"and"}
    )


def required() -> list[str]:
    """nacre, and what comes with it without an extra."""
    return ["nacre-materials", *_names(_project()["dependencies"])]


def distributions(page: Path) -> list[str]:
    """What the extras of a page, and the packages that it says to install, bring everywhere."""
    lines = [line for name in extras(page) for line in _project()["optional-dependencies"][name]]
    words = " ".join(page.read_text("utf-8").split())
    return [*re.findall(r"(?:^|[` ])pip install (\w[\w-]*)", words), *_names(lines)]


def _project() -> dict[str, Any]:
    found: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    return found


def _names(requirements: list[str]) -> list[str]:
    return [re.split(r"[^\w-]", line)[0] for line in requirements if ";" not in line]


def downloads(page: Path) -> list[str]:
    """The RGL files that a page downloads."""
    lines = re.findall(r"^nacre download rgl ((?:[a-z]\w* )+)", page.read_text("utf-8"), re.M)
    return [f"{name}_rgb.bsdf" for line in lines for name in line.split()]


def type_page(
    page: Path, python: Path | None = None, output: int | IO[str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Type a page in an empty folder, with a mirror of the real measurements if there are any.

    Parameters
    ----------
    page
        A page of Markdown.
    python
        The Python whose nacre is used, as installed; None for this one, whose names are also
        checked by `results.py`.
    output
        Where the output goes, as for `subprocess.run`.

    """
    environment = dict(os.environ)
    command = [str(python or sys.executable), "-P", str(_HERE / "typed.py"), str(page)]
    if python is None:
        command.append(str(_HERE / "results.py"))
    else:
        environment.pop("PYTHONPATH", None)
    new = tempfile.TemporaryDirectory
    with new() as state, new() as folder, _mirror() as address:
        environment |= {"NACRE_STATE": state, "NACRE_CACHE": state, "NACRE_MIRROR": address}
        return subprocess.run(
            command,
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            text=True,
        )


@contextmanager
def _mirror() -> Iterator[str]:
    """Address of a server on loopback that has the real measurements; empty without them."""
    folder = data_folder()
    if folder is None:
        yield ""
        return
    handler = functools.partial(_Quiet, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *arguments: object) -> None:
        pass
