"""What the site of `mkdocs.yml` has beside its pages: MathML for equations, the API reference."""

from __future__ import annotations

import html
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

EQUATION = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, config: Any) -> Files:
    """Add to `api/` what pdoc writes of the module `extra.api`; its warnings end the build."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-W", "error::UserWarning", "-m", "pdoc", "-o", folder]
        subprocess.run([*command, config.extra["api"]], check=True)
        for path in sorted(Path(folder).rglob("*.*")):
            name = f"api/{path.relative_to(folder).as_posix()}"
            files.append(File.generated(config, name, content=path.read_bytes()))
    return files


def on_page_content(content: str, **_: Any) -> str:
    """Equations as MathML, which browsers draw without a script."""

    def mathml(found: re.Match[str]) -> str:
        display = "block" if found[1] == "div" else "inline"
        return convert(html.unescape(found[2]).strip(), display=display)

    return EQUATION.sub(mathml, content)
