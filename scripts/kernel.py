"""Compile the fit kernel of the viewer's page to WebAssembly, the same bytes everywhere.

`python scripts/kernel.py [OUTPUT]` writes src/nacre/viewer/kernel/kernel.wasm, or another file.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "src" / "nacre" / "viewer" / "kernel"
SOURCES = {"network": "-O3", "random": "-Oz", "samples": "-Oz", "lobes": "-Oz", "scan": "-Oz"}
"""How sources are optimized: nearly all of the time goes into the first, and the page is small."""
COMPILER = (sys.executable, "-m", "ziglang", "cc", "-target", "wasm32-freestanding", "-nostdlib")
OPTIONS = ("-std=gnu11", "-msimd128", "-mbulk-memory", "-ffp-contract=off", "-fno-builtin")
LINKED = ("--no-entry", "--export-dynamic", "--strip-all", "-z,stack-size=65536")


def build(output: Path) -> None:
    """Compile the sources and link them."""
    with tempfile.TemporaryDirectory() as folder:
        objects = [Path(folder) / f"{name}.o" for name in SOURCES]
        for (name, level), made in zip(SOURCES.items(), objects, strict=True):
            # From their folder, so that nothing in them depends on where that is.
            command = (*COMPILER, *OPTIONS, level, "-c", f"{name}.c", "-o", str(made))
            subprocess.run(command, check=True, cwd=FOLDER)
        linked = [f"-Wl,{option}" for option in LINKED]
        subprocess.run([*COMPILER, *linked, *map(str, objects), "-o", str(output)], check=True)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER / "kernel.wasm"
    build(target)
    print(f"{target}: {target.stat().st_size} bytes")
