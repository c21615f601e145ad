"""Make this checkout runnable: virtual environment, pinned packages, an LLVM for Dr.Jit.

With `--tests`, also what runs exports: a browser, three.js, OpenGL and Vulkan on the processor.
Needs Python 3.11 or newer and nothing else; does only what is not done yet.
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
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
PYTHON = VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
LOCK = ROOT / "requirements.lock"
STAMP = VENV / "installed"
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


def make_environment() -> None:
    """Create the virtual environment."""
    if PYTHON.exists():
        return
    if importlib.util.find_spec("ensurepip") is None:
        package = f"python{sys.version_info.major}.{sys.version_info.minor}-venv"
        if not apt(package):
            stop(f"Python's venv module is missing: sudo apt-get install {package}")
    say(f"creating {VENV.name} with Python {sys.version.split()[0]}")
    run(sys.executable, "-m", "venv", VENV)


def install_packages() -> None:
    """Install the locked packages and this checkout, unless that was done for this lock file."""
    done = hashlib.sha256(
        LOCK.read_bytes() + (ROOT / "pyproject.toml").read_bytes() + str(ROOT).encode()
    ).hexdigest()
    if STAMP.exists() and STAMP.read_text() == done:
        return
    say("installing the packages of requirements.lock (a few minutes on a slow line)")
    pip = (PYTHON, "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    run(*pip, "-r", LOCK)
    run(*pip, "--no-deps", "--no-build-isolation", "-e", ROOT)
    STAMP.write_text(done)


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
    llvm = runpy.run_path(str(ROOT / "src" / "nacre" / "render" / "llvm.py"))
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


if __name__ == "__main__":
    if sys.version_info < (3, 11):
        stop(f"needs Python 3.11 or newer, this is {sys.version.split()[0]}; set PYTHON=python3.x")
    make_environment()
    install_packages()
    provide_libatomic()
    provide_llvm()
    if "--tests" in sys.argv[1:]:
        provide_browser()
        provide_shader_drivers()
    say("ready")
