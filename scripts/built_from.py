"""What the site was built from."""

from __future__ import annotations

import subprocess
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def built_from() -> str:
    """Version and commit in words, and whether files are not as committed; outside of a repository,
    the version alone.
    """
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    version = f"nacre {declared['version']}"
    if not (ROOT / ".git").exists():
        return version
    commit = _git("rev-parse", "--short", "HEAD")
    changed = ", with changes" if _git("status", "--porcelain") else ""
    return f"{version}, commit {commit}{changed}"


def _git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()
