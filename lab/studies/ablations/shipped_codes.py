"""The pretrained basis trained anew: `src/nacre/latent/published.safetensors`.

Materials are the networks that the authors of the NBRDF paper published, of MERL, of RGL and of
Nielsen et al. 2015; those of the RGL tables in the folder of test data are left out, so that these
are materials nobody trained on. The training is that of `nacre latent train --model hypernetwork`,
some minutes on one core; the same machine gives the same file.

Run `python -m lab.studies.ablations.shipped_codes`; the file goes to the folder of results.
"""

from __future__ import annotations

from pathlib import Path

from lab.studies.study import Study, data, rgl_tables
from nacre.cli import main as nacre


def networks() -> list[Path]:
    """The published networks but those of materials that tests use."""
    kept = {path.stem for path in rgl_tables()}
    return [p for p in sorted(data("pretrained").rglob("*.h5")) if p.stem not in kept]


def main() -> None:
    """Train."""
    study = Study(__doc__, __file__)
    options = study.options()
    output = str(study.output / "published.safetensors")
    files = map(str, study.few(networks(), 8))
    steps = ["--steps", "200"] if options.quick else []
    arguments = ["--model", "hypernetwork", "--seed", str(options.seed), *steps, "-o", output]
    nacre(["latent", "train", *files, *arguments])


if __name__ == "__main__":
    main()
