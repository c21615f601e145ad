"""Build packaging/recipe.yaml from the source archive in out/release; print what it made.

`python scripts/recipe.py [FOLDER]` in an environment with what requirements/release.lock names. The
package is written to FOLDER, by default out/release. Python, pip and hatchling are those
of that environment, under the names of conda's packages, so that no channel is needed; what the
package needs at run time is not installed, and its tests do not run.
"""

from __future__ import annotations

import platform
import shutil
import sys
import sysconfig
import tempfile
from importlib.metadata import version
from pathlib import Path

from rattler_build import Stage0Recipe, ToolConfiguration, assemble_package

ROOT = Path(__file__).resolve().parents[1]
RECIPE = ROOT / "packaging" / "recipe.yaml"


def write_stand_ins(channel: Path) -> None:
    """Packages of this environment's Python, pip and hatchling, for a channel on disk."""
    python = f"python{sys.version_info.major}.{sys.version_info.minor}"
    with tempfile.TemporaryDirectory() as work:
        prefix = Path(work)
        packages = prefix / "lib" / python / "site-packages"
        packages.mkdir(parents=True)
        (packages / "stand_in.pth").write_text(sysconfig.get_path("purelib") + "\n")
        (prefix / "bin").mkdir()
        (prefix / "bin" / "python").symlink_to(Path(sys.executable).resolve())
        home = Path(sys.executable).resolve().parent
        (prefix / "pyvenv.cfg").write_text(f"home = {home}\n")
        versions = {"python": platform.python_version()}
        versions |= {name: version(name) for name in ("pip", "hatchling")}
        for name, number in versions.items():
            folder = prefix if name == "python" else None
            assemble_package(name, number, "noarch", "0", channel / "noarch", files_dir=folder)


def build(folder: Path) -> Path:
    """The package that the recipe makes, moved to a folder."""
    with tempfile.TemporaryDirectory() as work:
        channel = Path(work)
        write_stand_ins(channel)
        (result,) = Stage0Recipe.from_file(RECIPE).run_build(
            tool_config=ToolConfiguration(test_strategy="skip"),
            output_dir=channel,  # a channel too, which comes before the others: there are none
            channels=[],
        )
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(result.packages[0], folder))


if __name__ == "__main__":
    print(build(Path(sys.argv[1]) if sys.argv[1:] else ROOT / "out" / "release"))
