"""Make this checkout runnable: virtual environment, pinned packages, an LLVM for Dr.Jit.

Needs Python 3.11 or newer and nothing else; does only what is not done yet.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
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


if __name__ == "__main__":
    if sys.version_info < (3, 11):
        stop(f"needs Python 3.11 or newer, this is {sys.version.split()[0]}; set PYTHON=python3.x")
    make_environment()
    install_packages()
    provide_libatomic()
    provide_llvm()
    say("ready")
