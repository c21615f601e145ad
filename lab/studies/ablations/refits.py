"""How often a library of networks is fitted again as nacre changes, by what its manifest goes by.

For the last commits of a branch: how many change any module, any module that the fit reaches, and
the code that it reaches, which is what the manifest goes by. `python -m
lab.studies.ablations.refits
--help`.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import nacre
from lab.studies.study import Study, log
from nacre.runtime import code_fingerprint
from nacre.runtime.code_fingerprint import code_text

ROOTS = ("nacre.neural.fitting:fit", "nacre.neural.file:encode", "nacre.measured.rgl:load")
"""Of a network that is fitted to an RGL material."""


def states(folder: Path) -> tuple[str, str, str]:
    """What must be the same for fits to be kept, of nacre in a folder: all modules, those that a
    fit reaches, and the code that it reaches.
    """
    search = code_fingerprint._Search({"nacre"})
    for root in ROOTS:
        search.reach(code_fingerprint._Target(*root.split(":")))
    modules = {line.split(":")[0].replace(".", "/") for line in search.found}
    texts = {path: code_text(path) for path in sorted((folder / "nacre").rglob("*.py"))}
    names = {path: path.relative_to(folder).as_posix().removesuffix(".py") for path in texts}
    reached = [texts[path] for path, n in names.items() if n.removesuffix("/__init__") in modules]
    return "".join(texts.values()), "".join(reached), "".join(sorted(search.found))


def main() -> None:
    study = Study(__doc__, __file__)
    study.add_argument("--branch", default="main")
    study.add_argument("--commits", type=int, default=100)
    options = study.options()
    root = Path(__file__).parents[3]
    listed = ["log", "--first-parent", f"--max-count={options.commits}", "--format=%H"]
    found = subprocess.check_output(["git", *listed, options.branch], cwd=root, text=True).split()
    folder, before = study.output / "state", None
    nacre.__file__ = str(folder / "src/nacre/__init__.py")
    counts, total = [0, 0, 0], 0
    for commit in reversed(found):
        content = subprocess.check_output(["git", "archive", commit, "src/nacre"], cwd=root)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        subprocess.run(["tar", "-x", "-C", folder], input=content, check=True)
        try:
            now = states(folder / "src")
        except ValueError as error:  # of a time when modules had other names
            log(commit[:8], error)
            continue
        if before is not None:
            total += 1
            counts = [count + (a != b) for count, a, b in zip(counts, before, now, strict=True)]
        before = now
        log(commit[:8], total, counts)
    rows = zip(("any code", "a module reached", "the code reached"), map(str, counts), strict=True)
    study.table(("changed", f"of {total} commits"), rows)


if __name__ == "__main__":
    main()
