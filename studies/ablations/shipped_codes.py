"""The basis that comes with nacre, trained anew: `src/nacre/latent/published.safetensors`.

Materials are the networks that the authors of the NBRDF paper published, of MERL, of RGL and of
Nielsen et al. 2015; those of the RGL tables in the folder of test data are left out, so that these
are materials nobody trained on. The training is that of `nacre latent train --model hypernetwork`,
some minutes on one core; the same machine gives the same file.

Run `python -m studies.ablations.shipped_codes [OUTPUT]` from the root of the repository.
"""

from __future__ import annotations

import sys
from pathlib import Path

from nacre.cli import main as nacre
from tests.data import data_folder

OUTPUT = Path("src/nacre/latent/published.safetensors")


def networks(data: Path) -> list[Path]:
    """The published networks but those of materials that tests use."""
    kept = {path.stem for path in (data / "rgl").glob("*.bsdf")}
    files = sorted((data / "pretrained").rglob("*.h5"))
    return [path for path in files if path.stem not in kept]


def main() -> None:
    """Train, or say what is missing."""
    data = data_folder()
    if data is None:
        sys.exit("no published networks: set NACRE_DATA to the folder that holds them")
    output = sys.argv[1] if sys.argv[1:] else str(OUTPUT)
    files = map(str, networks(data))
    nacre(["latent", "train", *files, "--model", "hypernetwork", "-o", output])


if __name__ == "__main__":
    main()
