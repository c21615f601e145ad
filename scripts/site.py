"""What the site of `mkdocs.yml` has beside its pages: MathML, the API reference, notebooks, and in
the footer what it was built from.
"""

from __future__ import annotations

import html
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from built_from import built_from
from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter
from nbconvert.filters import strip_ansi

EQUATION = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


class NotebookPage(File):
    """A page whose source is a notebook, so that links to the notebook lead to the page."""

    def is_documentation_page(self) -> bool:
        return True


def on_config(config: Any) -> Any:
    """Say on every page what it was built from."""
    config.copyright = built_from()
    return config


def on_files(files: Files, config: Any) -> Files:
    """Make pages from notebooks, and add to `api/` what pdoc writes about the module `extra.api`.

    pdoc's warnings end the build.
    """
    for file in [file for file in files if file.src_uri.endswith(".ipynb")]:
        files.remove(file)
        page, pictures = notebook_page(Path(file.abs_src_path))
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


def notebook_page(path: Path) -> tuple[str, dict[str, bytes]]:
    """A notebook with its outputs as Markdown, and its pictures by name."""
    resources = {"unique_key": path.stem, "output_files_dir": "pictures"}
    text, found = MarkdownExporter().from_filename(str(path), resources)
    text = re.sub(r"!\[(png|jpeg|svg)\]", "![What the cell shows]", strip_ansi(text))
    return text, found["outputs"]


def on_page_content(content: str, **_: Any) -> str:
    """Equations as MathML, which browsers draw without a script."""

    def mathml(found: re.Match[str]) -> str:
        display = "block" if found[1] == "div" else "inline"
        return convert(html.unescape(found[2]).strip(), display=display)

    return EQUATION.sub(mathml, content)
