"""Time and memory of reading tables, each in a process of its own.

The processes of two states of nacre take turns where `--against` names the folder `src` of another
checkout. `--spectral` makes, in the folder of results, a file of that many bytes with spectra in
place of the colors of the first table: published ones of anisotropic materials are as large.
`python -m lab.studies.speed.tables --help`.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from lab.studies.study import Study, log, rgl_tables
from nacre.measured.rgl_tables import read_tables
from nacre.measured.tensor_file import read_tensors, write_tensors

BANDS = 195
"""Of published spectral files, from 360 to 1000 nm."""

READ = """
import sys, time
import numpy as np
import nacre
from nacre.spectra import rgb_weights
def now():
    facts = dict(line.split(":") for line in open("/proc/self/status"))
    return [int(facts[name].split()[0]) * 1024 / 1e6 for name in ("VmRSS", "VmHWM")]
rgb_weights(np.linspace(400.0, 700.0, 4))
nacre.load(sys.argv[1])  # what is imported or read once
(before, most_before), start = now(), time.process_time()
material = nacre.load(sys.argv[2])
seconds = time.process_time() - start
held, most = now()
print(seconds * 1e3, most - max(before, most_before), held - before)
"""
"""What a process does: ms of processor time, MB more than before at most, MB held at the end."""


def spectral_file(table: Path, size: int, path: Path) -> Path:
    """A file of about so many bytes: the colors of a table, each in some of the bands."""
    fields, tables = read_tensors(table), read_tables(table)
    theta, height, width = tables.rgb.shape[1], *tables.rgb.shape[3:]
    wavelengths = np.linspace(360.0, 1000.0, BANDS, dtype=np.float32)
    channel = np.searchsorted([500.0, 600.0], wavelengths)
    one = np.maximum(tables.rgb[:, :, 2 - channel], 0.0).reshape(-1, theta, BANDS, height, width)
    azimuths = max(3, round(size / one[:1].nbytes))
    phi_i = np.linspace(-np.pi, np.pi, azimuths, dtype=np.float32)

    def repeated(values: np.ndarray) -> np.ndarray:
        return np.repeat(values[:1], azimuths, axis=0)

    changed = {"phi_i": phi_i, "wavelengths": wavelengths, "spectra": repeated(one)}
    changed |= {name: repeated(fields[name]) for name in ("vndf", "luminance")}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_tensors({n: a for n, a in fields.items() if n != "rgb"} | changed, path)
    return path


def main() -> None:
    study = Study(__doc__, __file__)
    study.add_argument("files", nargs="*", type=Path, help="tables (default: the first of RGL)")
    study.add_argument("--against", type=Path, help="folder src of another checkout")
    study.add_argument("--spectral", type=int, default=190_000_000, help="bytes; 0 for none")
    study.add_argument("--rounds", type=int, default=5)
    options = study.options()
    small = rgl_tables()[0]
    files = [*(options.files or [small])]
    if options.spectral:
        files.append(spectral_file(small, options.spectral, study.output / "made_spec.bsdf"))
    own = Path(__file__).parents[3] / "src"
    sources = [own] if options.against is None else [options.against.resolve(), own]
    rows = []
    for file in files:
        figures: dict[Path, list[list[float]]] = {source: [] for source in sources}
        for _ in range(options.rounds):
            for source in sources:
                done = subprocess.run(
                    [sys.executable, "-c", READ, small, file],
                    env={**os.environ, "PYTHONPATH": str(source)},
                    capture_output=True,
                    text=True,
                    check=True,
                )
                figures[source].append(list(map(float, done.stdout.split())))
                log(f"{source} {file.name}: {done.stdout.strip()}")
        medians = np.array([np.median(figures[source], axis=0) for source in sources])
        cells = [" → ".join(f"{value:.0f}" for value in values) for values in medians.T]
        rows.append([f"{file.name}, {file.stat().st_size / 1e6:.1f} MB", *cells])
    study.table(("file", "ms of processor", "most MB", "MB held"), rows)


if __name__ == "__main__":
    main()
