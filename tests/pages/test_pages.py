"""Every line of the README, the start and the guides runs in an empty folder; see `typed`."""

from __future__ import annotations

import ast
import importlib.metadata
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.support import run
from tests.data import require_data
from tests.pages.pages import PAGES, distributions, downloads, required, type_page
from tests.pages.typed import FEW, Block, TypingError, Typist, blocks, quick, shell_lines, shows
from tests.tiers import tiered

NOT_RUN = {
    "clusters": ["needs a cluster", "needs a cluster", "needs SLURM", "needs Kubernetes"],
    "from-photographs": ["needs a photograph and its surroundings"],
    "libraries": ["needs a GPU"],
    "textures": ["needs photographs", "takes hours"],
}
"""The blocks of pages that no test runs, by the page's name."""

FIRST = ("start",)


def names(page: Path) -> str:
    return page.stem


@pytest.mark.parametrize("page", tiered(PAGES[1::2], lambda page: page.stem in FIRST), ids=names)
def test_lines_run_as_typed(page: Path) -> None:
    run_as_typed(page)


def run_as_typed(page: Path) -> None:
    for name in distributions(page):
        try:
            importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            pytest.skip(f"{page.name} needs {name}")
    for name in downloads(page):
        require_data("rgl", name)
    done = type_page(page, output=subprocess.PIPE)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("page", PAGES, ids=names)
def test_what_lines_import_comes_with_what_the_page_installs(page: Path) -> None:
    """A test's own environment has more than a reader's."""
    code = [block.text for block in blocks(page.read_text("utf-8")) if block.language == "python"]
    imported = {name for text in code for name in _imports(text)} - sys.stdlib_module_names
    known = importlib.metadata.packages_distributions()
    brought = {name.lower() for name in [*required(), *distributions(page)]}
    missing = [n for n in imported if n in known and not {d.lower() for d in known[n]} & brought]
    assert not missing


def _imports(code: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.split(".")[0]


def test_few_blocks_are_left_out() -> None:
    found = {
        page.stem: [block.why_not for block in blocks(page.read_text("utf-8"))] for page in PAGES
    }
    left_out = {name: [why for why in reasons if why] for name, reasons in found.items()}
    assert {name: reasons for name, reasons in left_out.items() if reasons} == NOT_RUN


PAGE = """
```
nacre info a
nacre fit a \\
    -o b   # c
pip install nacre
```

<!-- not run: needs a network -->
```python
fetch()
```

Save this as `scene.xml`, in the folder:

```xml
<scene/>
```

```text
a
```
"""


def test_blocks_of_a_page() -> None:
    first, second, third, fourth = blocks(PAGE)
    lines = [(number, " ".join(line.split())) for number, line in shell_lines(first)]
    assert lines == [(3, "nacre info a"), (4, "nacre fit a -o b # c")]
    assert (second.language, second.why_not, second.line) == ("python", "needs a network", 11)
    assert (third.name, third.text) == ("scene.xml", "<scene/>\n")
    assert (fourth.language, fourth.name, fourth.why_not) == ("text", "", "")


@pytest.mark.parametrize(
    ("line", "typed"),
    [
        ("nacre render a.bsdf  # b", "nacre render --size 128 --spp 4 a.bsdf  # b"),
        ("nacre render a.bsdf --spp 9 --size 8", "nacre render a.bsdf --spp 9 --size 8"),
        (
            "nacre fit a -o - | nacre render -",
            "nacre fit a -o - | nacre render --size 128 --spp 4 -",
        ),
        ("nacre render scene.xml", "nacre render --spp 4 scene.xml"),
        ("nacre latent sample -o a", "nacre latent sample --spp 4 -o a"),
        ("nacre btf capture a -o b.npz", "nacre btf capture --paths 8 a -o b.npz"),
        ("nacre fit render", "nacre fit render"),
    ],
)
def test_lines_that_draw_take_few_samples(line: str, typed: str) -> None:
    assert quick(line) == typed


@pytest.mark.parametrize("command", FEW)
def test_commands_have_the_options_of_few_samples(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*command.split(), "--help") == 0
    printed = capsys.readouterr().out
    assert all(option.split()[0] in printed for option in FEW[command])


@pytest.mark.parametrize(
    ("expected", "printed", "same"),
    [
        ("a 1.00", "b\na  1.05\nc", True),
        ("a 1.00", "a 1.2", False),
        ("a ... c", "a b\nc", True),
        ("[0.505..., 0.3...]", "[0.5051, 0.3049]", True),
        ("a b", "a", False),
    ],
)
def test_what_is_printed(expected: str, printed: str, same: bool) -> None:
    assert shows(expected, printed) is same


@pytest.mark.parametrize(
    ("block", "problem"),
    [
        (Block(7, "", "true\nfalse\n", "", ""), "page.md:8: false\nends with exit code 1"),
        (Block(7, "", "true  # refused: a measurement\n", "", ""), "page.md:7: true"),
        (Block(7, "python", "a = 1\nb\n", "", ""), 'File "page.md", line 8'),
        (Block(7, "text", "a\n", "", ""), "page.md:7: this is not printed"),
        (Block(7, "glsl", "vec3 f = paint_eval(wi, wo);\n", "", ""), "no file defines paint_eval"),
        (Block(7, "cobol", "STOP RUN.\n", "", ""), "page.md:7: who runs cobol?"),
    ],
)
def test_lines_that_fail(
    block: Block, problem: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("paint.glsl").write_text("vec3 paint_pdf(vec3 wi, vec3 wo)")
    with pytest.raises(TypingError) as failure:
        Typist(Path("page.md")).type(block)
    assert problem in str(failure.value)


def test_lines_that_do_what_they_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    typist = Typist(Path("page.md"))
    for language, text in (
        ("", "echo 1 > a; exit 2  # refused: a reason\n"),
        ("", "trap 'exit 0' INT; echo at http://localhost; sleep 60 & wait  # until Ctrl-C\n"),
        ("python", "from pathlib import Path\nprint(Path('a').read_text())\n"),
        ("text", "1\n"),
    ):
        typist.type(Block(1, language, text, "", ""))
    typist.type(Block(1, "python", "1 / 0\n", "needs a miracle", ""))
    typist.type(Block(1, "c", "int a;\n", "", "a.c"))
    assert Path("a.c").read_text() == "int a;\n"
