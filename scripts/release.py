"""Build a release twice from the committed tree, check it, and print the checklist's outcome.

`make release`, or `python scripts/release.py` in an environment with what
requirements/release.lock names. Everything is left in out/release: a wheel and a source archive of
each package, conda's package, the site, a bill of materials (CycloneDX), a report of licenses, and
the SHA-256 sums of all. The exit code is 1 where a check failed.
"""

from __future__ import annotations

import hashlib
import os
import posixpath
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "out" / "release"
TOOLS = Path(sys.executable).parent
FILE_LIMIT = 3 << 20
"""Bytes of one file in an archive."""
EXTRA = "render"
"""What is installed for the bill of materials and the report of licenses."""
LINK = re.compile(r"\]\(([^)\s:#][^)\s:]*)\)")
"""A link of Markdown to another file."""


@dataclass(frozen=True)
class Package:
    """One of the packages that are released together.

    Parameters
    ----------
    name
        Name on an index.
    folder
        Where its pyproject.toml is.
    module
        What is imported.
    needed
        Files that its source archive must have, and licenses among them that its wheel must have.
    wheel_limit, source_limit
        Bytes of the archives.
    """

    name: str
    folder: Path
    module: str
    needed: tuple[str, ...]
    wheel_limit: int
    source_limit: int

    @property
    def declared(self) -> dict[str, Any]:
        """The table `project` of its pyproject.toml."""
        text = (self.folder / "pyproject.toml").read_text("utf-8")
        return dict(tomllib.loads(text)["project"])

    def artifact(self, ending: str) -> Path:
        """The wheel (".whl") or the source archive (".tar.gz")."""
        found = list(FOLDER.glob(f"{self.name.replace('-', '_')}-*{ending}"))
        require(len(found) == 1, f"{len(found)} files {ending} of {self.name} in out/release")
        return found[0]


NACRE = Package(
    "nacre-materials",
    ROOT,
    "nacre",
    ("LICENSE", "NOTICE", "README.md", "CHANGELOG.md", "SECURITY.md", "CITATION.cff"),
    7 << 20,
    8 << 20,
)
LAB = Package(
    "nacre-lab", ROOT / "lab", "nacre_lab", ("LICENSE", "README.md"), 256 << 10, 512 << 10
)
PACKAGES = NACRE, LAB


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
    return str(NACRE.declared["version"])


def committed() -> str:
    """The tree is what was committed."""
    changed = run("git", "status", "--porcelain").splitlines()
    require(not changed, f"{len(changed)} files are not as committed: {', '.join(changed[:3])}")
    tagged = f"v{version()}" in run("git", "tag", "--points-at", "HEAD").split()
    return f"{commit()}, {'tagged' if tagged else 'not tagged'} v{version()}"


def commit() -> str:
    """The commit, shortened."""
    return run("git", "rev-parse", "--short", "HEAD").strip()


def versions_agree() -> str:
    """One version in both packages, the citation, the recipe and the changelog."""
    require(LAB.declared["version"] == version(), f"the lab is not of version {version()}")
    wanted = [need for need in LAB.declared["dependencies"] if need.startswith(NACRE.name)]
    same = [need for need in wanted if need.endswith(f"=={version()}")]
    require(bool(same), f"the lab needs {wanted}, not version {version()}")
    for name, pattern in {
        "src/nacre/__init__.py": '__version__ = "{}"\n',
        "CITATION.cff": "\nversion: {}\n",
        "packaging/recipe.yaml": '\n  version: "{}"\n',
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
            run("tar", "-xf", Path(work) / "tree.tar", "-C", tree)
            build = (sys.executable, "-m", "build", "--no-isolation", "-o", output)
            for package in PACKAGES:
                place = package.folder.relative_to(ROOT)
                readme = tree / place / "README.md"
                readme.write_text(absolute_links(readme.read_text("utf-8"), place), "utf-8")
                run(*build, cwd=tree / place, SOURCE_DATE_EPOCH=time)
            sums.append(
                {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in output.iterdir()}
            )
        require(sums[0] == sums[1], f"builds differ: {sums[0]} {sums[1]}")
        for path in output.iterdir():
            shutil.copy(path, FOLDER)
    return "identical"


def absolute_links(text: str, folder: Path) -> str:
    """Let the links of a page in a folder lead to the released files, if `project.urls` has the
    address `Source`: an index shows the page alone.
    """
    address = NACRE.declared.get("urls", {}).get("Source")

    def absolute(found: re.Match[str]) -> str:
        path, mark, part = found[1].partition("#")
        target = posixpath.normpath((folder / path).as_posix())
        kind = "raw" if path.endswith((".jpg", ".png", ".svg")) else "blob"
        return f"]({address}/{kind}/v{version()}/{target}{mark}{part})"

    return LINK.sub(absolute, text) if address else text


def contents() -> str:
    """What is in the archives, and nothing large."""
    return "; ".join(map(packed, PACKAGES))


def packed(package: Package) -> str:
    """Check a package's archives; their sizes."""
    wheel, source = package.artifact(".whl"), package.artifact(".tar.gz")
    with zipfile.ZipFile(wheel) as archive:
        inside = {entry.filename: entry.file_size for entry in archive.infolist()}
    with tarfile.open(source) as members_of:
        members = {m.name.partition("/")[2]: m.size for m in members_of.getmembers()}
    metadata = f"{wheel.name.partition('-py3')[0]}.dist-info/"
    strange = [n for n in inside if not n.startswith((f"{package.module}/", metadata))]
    require(not strange, f"{wheel.name}: {strange[:3]} lie outside of the package")
    licenses = [f"licenses/{name}" for name in ("LICENSE", "NOTICE") if name in package.needed]
    for needed in (*licenses, "entry_points.txt"):
        require(metadata + needed in inside, f"{wheel.name}: {needed} is missing")
    for needed in package.needed:
        require(needed in members, f"{source.name}: {needed} is missing")
    committed_files = run("git", "ls-files", "src", cwd=package.folder).splitlines()
    left_out = [
        f for f in committed_files if f not in members or f.removeprefix("src/") not in inside
    ]
    require(not left_out, f"{package.name}: left out: {left_out[:3]}")
    foreign = [n for n in members if n.startswith("lab/")]
    require(not foreign, f"{source.name}: has {foreign[:3]}")
    large = [n for found in (inside, members) for n, size in found.items() if size > FILE_LIMIT]
    require(not large, f"larger than {FILE_LIMIT:,} bytes: {large}")
    for path, limit in ((wheel, package.wheel_limit), (source, package.source_limit)):
        require(path.stat().st_size <= limit, f"{path.name}: more than {limit:,} bytes")
    sizes = wheel.stat().st_size, source.stat().st_size
    return f"{package.name}: wheel {sizes[0]:,} bytes, source archive {sizes[1]:,}"


def description() -> str:
    """An index can render the descriptions."""
    archives = [package.artifact(end) for package in PACKAGES for end in (".whl", ".tar.gz")]
    run(sys.executable, "-m", "twine", "check", "--strict", *archives)
    relative = []
    for package in PACKAGES:
        with tarfile.open(package.artifact(".tar.gz")) as archive:
            name = next(name for name in archive.getnames() if name.endswith("/PKG-INFO"))
            member = archive.extractfile(name)
            relative += LINK.findall(member.read().decode() if member else "")
    missing = f"; {len(relative)} links lead nowhere on an index without `Source` in project.urls"
    return f"rendered by twine{missing if relative else ''}"


def installed() -> str:
    """The wheels work in empty environments; see scripts/matrix.py."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    rows = [f"{python}-{what}-highest" for what in ("none", EXTRA, "lab")]
    run(sys.executable, ROOT / "scripts" / "matrix.py", *rows)
    return f"Python {python}: without extras, nacre demo with [{EXTRA}], and with the lab"


def bill() -> str:
    """What comes along: a bill of materials, and licenses."""
    with tempfile.TemporaryDirectory() as work:
        python = Path(work) / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        run(TOOLS / "uv", "venv", "-q", "--python", sys.executable, Path(work) / "venv")
        wanted = f"{NACRE.artifact('.whl')}[{EXTRA}]"
        run(TOOLS / "uv", "pip", "install", "-q", "--python", python, wanted)
        sbom = FOLDER / "sbom.cdx.json"
        run(TOOLS / "cyclonedx-py", "environment", "--output-reproducible", "-o", sbom, python)
        options = ("--from=mixed", "--format=csv", "--with-urls", f"--python={python}")
        text = run(TOOLS / "pip-licenses", *options)
    (FOLDER / "licenses.csv").write_text(text)
    unknown = [line for line in text.splitlines() if "UNKNOWN" in line.split(",")[2]]
    require(not unknown, f"no license is stated: {unknown}")
    return f"{len(text.splitlines()) - 1} packages"


def recipe() -> str:
    """The conda recipe builds, on stand-ins for what it is built with; see scripts/recipe.py."""
    made = run(sys.executable, ROOT / "scripts" / "recipe.py", FOLDER).splitlines()[-1]
    return Path(made).name


def site() -> str:
    """The site is from this commit."""
    run("make", "site")
    pages, place = ROOT / "out" / "site", FOLDER / f"nacre-site-{version()}.zip"
    origin = f"nacre {version()}, commit {commit()}"
    require((pages / "index.html").exists(), "the page of all materials is missing")
    for name in ("docs/index.html", "docs/results/reliability.html"):  # the front has it packed
        stated = (pages / name).read_text("utf-8")
        found = re.search(rf"{origin}(?!\w|, with)", stated)
        require(found is not None, f"{name}: is not from {origin}")
    with zipfile.ZipFile(place, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(path for path in pages.rglob("*") if path.is_file()):
            archive.write(path, path.relative_to(pages))
    return f"{place.stat().st_size:,} bytes"


def sums() -> str:
    """SHA-256 sums."""
    files = sorted(path for path in FOLDER.iterdir() if path.name != "SHA256SUMS")
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files]
    (FOLDER / "SHA256SUMS").write_text("".join(lines))
    return f"of {len(files)} files"


CHECKS: tuple[Callable[[], str], ...] = (
    committed,
    versions_agree,
    citation,
    built_twice,
    contents,
    description,
    recipe,
    site,
    installed,
    bill,
    sums,
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
