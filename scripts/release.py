"""Build a release twice from the committed tree, check it, and print the checklist's outcome.

`make release`, or `python scripts/release.py` in an environment with what scripts/release.lock
names. Everything is left in out/release: wheel, source archive, their SHA-256 sums, a bill of
materials (CycloneDX) and a report of licenses. The exit code is 1 where a check failed.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "out" / "release"
TOOLS = Path(sys.executable).parent
WHEEL_LIMIT, SOURCE_LIMIT, FILE_LIMIT = 7 << 20, 8 << 20, 3 << 20
"""Bytes of a wheel, of a source archive, and of one file in either."""
EXTRA = "render"
"""What is installed for the bill of materials and the report of licenses."""


class FailedError(Exception):
    """A check that failed; the message says why."""


def run(*command: str | Path, cwd: Path = ROOT, **environment: str) -> str:
    """What a command prints; its last words are those of a :class:`FailedError`."""
    words = [str(part) for part in command]
    done = subprocess.run(
        words, cwd=cwd, env=os.environ | environment, capture_output=True, text=True
    )
    if done.returncode:
        last = (done.stderr.strip() or done.stdout.strip() or "failed").splitlines()[-1]
        raise FailedError(f"{Path(words[0]).name} {words[1]}: {last}")
    return done.stdout


def require(whole: bool, problem: str) -> None:
    """Fail with a problem unless all is well."""
    if not whole:
        raise FailedError(problem)


def version() -> str:
    """The version in pyproject.toml."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    return str(declared["project"]["version"])


def artifact(ending: str) -> Path:
    """The wheel (".whl") or the source archive (".tar.gz")."""
    found = list(FOLDER.glob(f"*{ending}"))
    require(len(found) == 1, f"{len(found)} files *{ending} in {FOLDER.relative_to(ROOT)}")
    return found[0]


def committed() -> str:
    """The tree is what was committed."""
    changed = run("git", "status", "--porcelain").splitlines()
    require(not changed, f"{len(changed)} files are not as committed: {', '.join(changed[:3])}")
    return run("git", "rev-parse", "--short", "HEAD").strip()


def versions_agree() -> str:
    """One version in the package, the citation and the changelog."""
    for name, pattern in {
        "src/nacre/__init__.py": '__version__ = "{}"\n',
        "CITATION.cff": "\nversion: {}\n",
        "CHANGELOG.md": "\n## {} - ",
    }.items():
        text = (ROOT / name).read_text("utf-8")
        require(pattern.format(version()) in text, f"{name} is not of version {version()}")
    return version()


def citation() -> str:
    """The citation is valid."""
    run(TOOLS / "uv", "tool", "run", "-q", "cffconvert", "--validate", "-i", "CITATION.cff")
    return "valid by cffconvert"


def built_twice() -> str:
    """Two builds from clean trees have the same bytes."""
    time = run("git", "log", "-1", "--format=%ct").strip()
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    sums = []
    with tempfile.TemporaryDirectory() as work:
        for number in ("first", "second"):
            tree, output = Path(work) / number, Path(work) / f"{number}-output"
            tree.mkdir()
            run("git", "archive", "-o", Path(work) / "tree.tar", "HEAD")
            shutil.unpack_archive(Path(work) / "tree.tar", tree, filter="data")
            build = (sys.executable, "-m", "build", "--no-isolation", "-o", output)
            run(*build, cwd=tree, SOURCE_DATE_EPOCH=time)
            sums.append(
                {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in output.iterdir()}
            )
        require(sums[0] == sums[1], f"builds differ: {sums[0]} {sums[1]}")
        for path in output.iterdir():
            shutil.copy(path, FOLDER)
    lines = [f"{digest}  {name}\n" for name, digest in sorted(sums[0].items())]
    (FOLDER / "SHA256SUMS").write_text("".join(lines))
    return "identical"


def contents() -> str:
    """What is in the archives, and nothing large."""
    wheel, source = artifact(".whl"), artifact(".tar.gz")
    with zipfile.ZipFile(wheel) as archive:
        inside = {entry.filename: entry.file_size for entry in archive.infolist()}
    with tarfile.open(source) as packed:
        members = {m.name.partition("/")[2]: m.size for m in packed.getmembers()}
    metadata = f"nacre_materials-{version()}.dist-info/"
    strange = [n for n in inside if not n.startswith(("nacre/", metadata))]
    require(not strange, f"wheel: {strange[:3]} lie outside of the package")
    for needed in ("licenses/LICENSE", "licenses/NOTICE", "entry_points.txt"):
        require(metadata + needed in inside, f"wheel: {needed} is missing")
    for needed in ("LICENSE", "NOTICE", "README.md", "CHANGELOG.md", "SECURITY.md", "CITATION.cff"):
        require(needed in members, f"source archive: {needed} is missing")
    committed_files = run("git", "ls-files", "src").splitlines()
    left_out = [
        f for f in committed_files if f not in members or f.removeprefix("src/") not in inside
    ]
    require(not left_out, f"left out: {left_out[:3]}")
    large = [n for found in (inside, members) for n, size in found.items() if size > FILE_LIMIT]
    require(not large, f"larger than {FILE_LIMIT:,} bytes: {large}")
    for path, limit in ((wheel, WHEEL_LIMIT), (source, SOURCE_LIMIT)):
        require(path.stat().st_size <= limit, f"{path.name}: more than {limit:,} bytes")
    return f"wheel {wheel.stat().st_size:,} bytes, source archive {source.stat().st_size:,}"


def description() -> str:
    """An index can render the description."""
    run(sys.executable, "-m", "twine", "check", "--strict", artifact(".whl"), artifact(".tar.gz"))
    text = (ROOT / "README.md").read_text("utf-8")
    relative = [link for link in re.findall(r"\]\(([^)\s]+)\)", text) if ":" not in link]
    return f"rendered by twine; {len(relative)} links are relative and lead nowhere on an index"


def installed() -> str:
    """The wheel works in empty environments, with and without the extra; see scripts/matrix.py."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    rows = [f"{python}-{extra}-highest" for extra in ("none", EXTRA)]
    run(sys.executable, ROOT / "scripts" / "matrix.py", *rows)
    return f"Python {python}: without extras, and nacre demo with [{EXTRA}]"


def bill() -> str:
    """What comes along: a bill of materials, and licenses."""
    with tempfile.TemporaryDirectory() as work:
        python = Path(work) / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        run(TOOLS / "uv", "venv", "-q", "--python", sys.executable, Path(work) / "venv")
        wanted = f"{artifact('.whl')}[{EXTRA}]"
        run(TOOLS / "uv", "pip", "install", "-q", "--python", python, wanted)
        sbom = FOLDER / "sbom.cdx.json"
        run(TOOLS / "cyclonedx-py", "environment", "--output-reproducible", "-o", sbom, python)
        options = ("--from=mixed", "--format=csv", "--with-urls", f"--python={python}")
        text = run(TOOLS / "pip-licenses", *options)
    (FOLDER / "licenses.csv").write_text(text)
    unknown = [line for line in text.splitlines() if "UNKNOWN" in line.split(",")[2]]
    require(not unknown, f"no license is stated: {unknown}")
    return f"{len(text.splitlines()) - 1} packages"


CHECKS: tuple[Callable[[], str], ...] = (
    committed,
    versions_agree,
    citation,
    built_twice,
    contents,
    description,
    installed,
    bill,
)


def main() -> int:
    """Do every check and say what came of it; the exit code."""
    failed = 0
    for check in CHECKS:
        title = str(check.__doc__).partition(";")[0].rstrip(".")
        try:
            print(f"[x] {title}: {check()}", flush=True)
        except FailedError as error:
            failed += 1
            print(f"[ ] {title}: {error}", flush=True)
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
