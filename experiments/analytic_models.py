"""How close each analytic model comes to measured tables, and how long its fit takes.

Printed is the loss of the NBRDF paper (mean |log(1 + f cos) - log(1 + g cos)| over the samples
fitted to), its mean and largest value over the files, and seconds a fit.

Run `python experiments/analytic_models.py FILE...`.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import nacre
from nacre.analytic import MODELS, fit


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="+", help="any materials")
    parser.add_argument("--gain", type=float, default=1.0, help="gain of the loss")
    options = parser.parse_args()
    materials = [nacre.load(path) for path in options.files]
    print("| model | mean loss | largest | s a fit |")
    print("|---|---:|---:|---:|")
    for name, model in MODELS.items():
        start = time.perf_counter()
        fits = [fit(material, model, gain=options.gain) for material in materials]
        seconds = (time.perf_counter() - start) / len(fits)
        losses = [fitted.metadata["fit"]["loss"] for fitted in fits]
        print(f"| {name} | {np.mean(losses):.4f} | {max(losses):.4f} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main()
