"""What the site of `mkdocs.yml` has beside its pages: MathML, the API reference, run notebooks."""

from __future__ import annotations

import html
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files
from nbclient import NotebookClient
from nbconvert import MarkdownExporter
from nbconvert.filters import strip_ansi

EQUATION = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


class NotebookPage(File):
    """A page whose source is a notebook, so that links to the notebook lead to the page."""

    def is_documentation_page(self) -> bool:
        return True


def on_files(files: Files, config: Any) -> Files:
    """Run the notebooks if `extra.run` says so, and add to `api/` what pdoc writes of the module
    `extra.api`.

    A cell that fails ends the build, and so do pdoc's warnings.
    """
    for file in [file for file in files if file.src_uri.endswith(".ipynb")]:
        files.remove(file)
        page, pictures = executed(Path(file.abs_src_path), config.extra["run"])
        files.append(NotebookPage.generated(config, file.src_uri, content=page))
        for name, content in pictures.items():
            place = (Path(file.src_uri).parent / name).as_posix()
            files.append(File.generated(config, place, content=content))
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-W", "error::UserWarning", "-m", "pdoc", "-o", folder]
        # Not as modules, which these two are for names of 0.2 only.
        without = r"!nacre\.(render|export)$"
        subprocess.run([*command, config.extra["api"], without], check=True)
        for path in sorted(Path(folder).rglob("*.*")):
            name = f"api/{path.relative_to(folder).as_posix()}"
            files.append(File.generated(config, name, content=path.read_bytes()))
    return files


def executed(path: Path, run: bool) -> tuple[str, dict[str, bytes]]:
    """A notebook as Markdown and its pictures, after all of its cells ran in an empty folder."""
    notebook = nbformat.read(path, as_version=4)
    commands = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            notebook,
            startup_timeout=600,
            timeout=600,
            resources={"metadata": {"path": folder}},
            extra_arguments=["--log-level=ERROR"],  # it warns of every connection
            coalesce_streams=True,
        )
        if run:
            client.execute(env=os.environ | {"PATH": commands})
    for cell in notebook.cells:  # JPEGs that Pillow offers beside its PNGs
        for output in cell.get("outputs", []):
            output.get("data", {}).pop("image/jpeg", None)
    resources = {"unique_key": path.stem, "output_files_dir": "pictures"}
    text, found = MarkdownExporter().from_notebook_node(notebook, resources)
    return strip_ansi(text).replace("![png]", "![What the cell shows]"), found["outputs"]


def on_page_content(content: str, **_: Any) -> str:
    """Equations as MathML, which browsers draw without a script."""

    def mathml(found: re.Match[str]) -> str:
        display = "block" if found[1] == "div" else "inline"
        return convert(html.unescape(found[2]).strip(), display=display)

    return EQUATION.sub(mathml, content)
