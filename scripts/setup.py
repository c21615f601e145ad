"""Make this checkout runnable: virtual environment, pinned packages, an LLVM for Dr.Jit.

`python scripts/setup.py [demo|test|docs|fuzz|lab|tools]...` installs what the files of these names
in `requirements/` list. `lab` is the package in `lab/`; `tools` is what makes the site, and what
runs exports: a browser, three.js, OpenGL and Vulkan on the processor. Needs Python 3.11 or newer
and nothing else; does only what is not done yet.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import json
import os
import runpy
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
PYTHON = VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
LOCKS = ROOT / "requirements"
HAS_PIP = importlib.util.find_spec("pip") is not None
"""Whether this Python's pip can work for the environment, which then needs none."""
PIP = (
    *((sys.executable, "-m", "pip", "--python", PYTHON) if HAS_PIP else (PYTHON, "-m", "pip")),
    *("--disable-pip-version-check", "install", "--quiet", "--no-compile"),
)
"""Modules are compiled when they are first imported: few of those that are installed ever are."""
PACKAGES = {
    "three": "0.187.0",
    "@khronosgroup/gltf-viewer": "1.1.0",
    "gltf-validator": "2.0.0-dev.3.10",
    "axe-core": "4.14.1",
}
"""Versions of npm's packages that exports, written files and pages are tested with."""


def say(text: str) -> None:
    """Tell the user what happens next."""
    print(f"setup: {text}", flush=True)


def stop(text: str) -> None:
    """End with what the user has to do."""
    sys.exit(f"setup: {text}")


def run(*command: str | Path) -> None:
    """Run a command; end if it fails."""
    if subprocess.run([str(part) for part in command]).returncode:
        stop(f"failed: {' '.join(str(part) for part in command)}")


def apt(package: str) -> bool:
    """Install a Debian package if this machine and its user can; whether that worked."""
    if not shutil.which("apt-get"):
        return False
    prefix = []
    if os.geteuid() != 0:
        if (
            not shutil.which("sudo")
            or subprocess.run(["sudo", "-n", "true"], capture_output=True).returncode
        ):
            return False
        prefix = ["sudo", "-n"]
    say(f"installing Debian's {package}")
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    for command in (["apt-get", "update"], ["apt-get", "install", "-y", package]):
        result = subprocess.run(
            [*prefix, *command], env=environment, capture_output=True, text=True
        )
    if result.returncode:
        say(result.stderr.strip())
    return result.returncode == 0


def refuse_another() -> None:
    """End if the environment is another checkout's, as a linked or a moved one is."""
    package = "nacre_materials-*.dist-info/direct_url.json"
    for place in (f"lib/python*/site-packages/{package}", f"Lib/site-packages/{package}"):
        for record in VENV.glob(place):
            owner = Path(url2pathname(urlsplit(json.loads(record.read_text())["url"]).path))
            if owner.resolve() != ROOT:
                stop(f"{VENV} was set up for {owner}: remove it or the link, then run this again")


def make_environment() -> None:
    """Create the virtual environment."""
    if PYTHON.exists():
        refuse_another()
        return
    if not HAS_PIP and importlib.util.find_spec("ensurepip") is None:
        package = f"python{sys.version_info.major}.{sys.version_info.minor}-venv"
        if not apt(package):
            stop(f"Python's venv module is missing: sudo apt-get install {package}")
    say(f"creating {VENV.name} with Python {sys.version.split()[0]}")
    run(sys.executable, "-m", "venv", *(["--without-pip"] if HAS_PIP else []), VENV)


def once(name: str, *files: Path, install: Callable[[], None]) -> None:
    """Install something, unless that was done with these files."""
    stamp = VENV / f"{name}.installed"
    content = b"".join(path.read_bytes() for path in files) + str(ROOT).encode()
    done = hashlib.sha256(content).hexdigest()
    if stamp.exists() and stamp.read_text() == done:
        return
    say(f"installing what {files[0].relative_to(ROOT)} names (a few minutes on a slow line)")
    install()
    stamp.write_text(done)


def provide_demo() -> None:
    """Install what the main job needs, and this checkout."""

    def install() -> None:
        lines = (LOCKS / "demo.lock").read_text().splitlines()
        packages = [line for line in lines if not line.startswith("#")]
        half = len(packages) // 2
        # The lock is complete, so nothing is resolved, and one half does not wait for the other.
        installers = [
            subprocess.Popen([*map(str, PIP), "--no-deps", *part])
            for part in (packages[:half], packages[half:])
        ]
        try:
            provide_libraries()
        finally:
            failed = [installer.wait() for installer in installers]
        if any(failed):
            stop("pip failed: see above")
        install_checkout(ROOT)

    once("demo", LOCKS / "demo.lock", ROOT / "pyproject.toml", install=install)
    provide_libraries()


def install_checkout(project: Path) -> None:
    """Install a project of this checkout so that changes of it have an effect."""
    run(*PIP, "--no-deps", "--no-build-isolation", "-e", project)


def provide_lock(name: str) -> None:
    """Install what a lock adds."""
    files = [LOCKS / f"{lock}.lock" for lock in dict.fromkeys(("demo", "test", name))]
    options = [option for file in files for option in ("-r", file)]
    once(name, files[-1], install=lambda: run(*PIP, *options))


def provide_lab() -> None:
    """Install the package of the lab."""
    lab = ROOT / "lab"
    once("lab", lab / "pyproject.toml", install=lambda: install_checkout(lab))


def provide_libraries() -> None:
    """Make sure that there is what Mitsuba and Dr.Jit load."""
    provide_libatomic()
    provide_llvm()


def provide_libatomic() -> None:
    """Make sure that there is the library of GCC's atomics, which Dr.Jit's Linux wheels need."""
    if not sys.platform.startswith("linux"):
        return
    try:
        ctypes.CDLL("libatomic.so.1")
    except OSError:
        if not apt("libatomic1"):
            stop(
                "libatomic.so.1 is missing: sudo apt-get install libatomic1 (Debian, Ubuntu), "
                "sudo dnf install libatomic (Fedora), sudo pacman -S gcc-libs (Arch)"
            )


def provide_llvm() -> None:
    """Make sure that there is an LLVM with which Dr.Jit can compile."""
    llvm = runpy.run_path(str(ROOT / "src" / "nacre" / "mitsuba" / "llvm.py"))
    if llvm["prepare"]() or (apt("libllvm19") and llvm["prepare"]()):
        return
    stop(llvm["refusal"](None))


def provide_browser() -> None:
    """Offer what runs exports in web pages; without it their tests are skipped."""
    browsers = "chromium", "chromium-browser", "google-chrome"
    if not any(map(shutil.which, browsers)) and not apt("chromium"):
        say("without Chromium, tests of exports in web pages are skipped")
    folder = VENV / "three"

    def installed(name: str, version: str) -> bool:
        facts = folder / "node_modules" / name / "package.json"
        return facts.exists() and json.loads(facts.read_text())["version"] == version

    if all(installed(*package) for package in PACKAGES.items()):
        return
    npm = shutil.which("npm")
    quiet = ("--ignore-scripts", "--no-audit", "--no-fund", "--no-package-lock", "--silent")
    folder.mkdir(exist_ok=True)
    wanted = [f"{name}@{version}" for name, version in PACKAGES.items()]
    command = ("install", "--prefix", str(folder), *quiet, *wanted)
    if npm is None or subprocess.run([npm, *command]).returncode:
        say(f"without npm's {', '.join(wanted)}, tests that need them are skipped")


def provide_shader_drivers() -> None:
    """Have OpenGL and Vulkan on the processor where Debian's packages bring them.

    Without them the tests that run exported shaders are skipped, so nobody has to install them.
    """
    drivers = {
        "libEGL.so.1": "libegl1",
        "libGL.so.1": "libgl1",
        "libvulkan_lvp.so": "mesa-vulkan-drivers",
    }
    if not sys.platform.startswith("linux"):
        return
    for library, package in drivers.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            if not apt(package):
                say(f"without {library} (Debian: {package}), tests of some exports are skipped")
    if not shutil.which("glslangValidator") and not apt("glslang-tools"):
        say("without glslangValidator (Debian: glslang-tools), exported HLSL is not run")


def provide_tools() -> None:
    """Offer what runs exports."""
    provide_browser()
    provide_shader_drivers()


STEPS: dict[str, tuple[Callable[[], None], tuple[str, ...]]] = {
    "demo": (provide_demo, ()),
    "test": (lambda: provide_lock("test"), ("demo",)),
    "docs": (lambda: provide_lock("docs"), ("test",)),
    "fuzz": (lambda: provide_lock("fuzz"), ("test",)),
    "lab": (provide_lab, ("test",)),
    "tools": (provide_tools, ("docs",)),
}
"""What can be set up, and what before it."""


def ordered(names: list[str]) -> dict[str, Callable[[], None]]:
    """The steps of what is asked for, each after what it needs."""
    steps: dict[str, Callable[[], None]] = {}
    for name in names:
        provide, needs = STEPS[name]
        steps |= ordered(list(needs)) | {name: provide}
    return steps


if __name__ == "__main__":
    if sys.version_info < (3, 11):
        stop(f"needs Python 3.11 or newer, this is {sys.version.split()[0]}; set PYTHON=python3.x")
    asked = sys.argv[1:] or ["demo"]
    if unknown := [name for name in asked if name not in STEPS]:
        stop(f"no such set-up: {', '.join(unknown)}; there are {', '.join(STEPS)}")
    make_environment()
    for step in ordered(asked).values():
        step()
    say("ready")
