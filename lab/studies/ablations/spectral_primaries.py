"""The table of `nacre.color`: three spectra that stand for red, green and blue.

Solves the constrained least squares of Mallett and Yuksel 2019, "Spectral Primary Decomposition
for Rendering with sRGB Reflectance": the smoothest spectra (least sum of squared steps) that lie in
[0, 1], sum to 1 at every wavelength and, lit by D65 and seen by the CIE 1931 2-degree observer,
have the linear Rec. 709 colors (1, 0, 0), (0, 1, 0) and (0, 0, 1). Observer and illuminant are
those of Mitsuba, so that its spectral and its RGB variants agree. Differs from the paper in the
grid: every 10 nm over the 360 to 830 nm that Mitsuba samples, linear in between.

Run `python -m lab.studies.ablations.spectral_primaries`: prints the two rows of the module, red and
blue (green is what they leave of 1), and how well they reproduce the primaries.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

import nacre.mitsuba
from lab.studies.study import Study

Matrix = npt.NDArray[np.float64]

NODES = np.arange(360.0, 831.0, 10.0)
DIGITS = 5


def response() -> Matrix:
    """Linear Rec. 709 color under D65 of a unit value at each node, shape (3, nodes)."""
    mi = nacre.mitsuba.mitsuba("llvm_ad_spectral")
    fine = np.arange(360.0, 831.0, 1.0)
    interaction = mi.SurfaceInteraction3f()
    interaction.wavelengths = mi.Float(fine)
    light = np.array(mi.load_dict({"type": "d65"}).eval(interaction), np.float64)[0]
    observer = np.array(mi.cie1931_xyz(mi.Float(fine)), np.float64)
    weights = np.full(len(fine), 1.0)
    weights[[0, -1]] = 0.5
    xyz = observer * light * weights
    to_rgb = np.stack(
        [np.array(mi.xyz_to_srgb(mi.Color3f(axis)), np.float64).ravel() for axis in np.eye(3)], 1
    )
    hats = np.stack([np.interp(fine, NODES, unit) for unit in np.eye(len(NODES))])
    return to_rgb @ (xyz / xyz[1].sum()) @ hats.T


def solve(color: Matrix) -> Matrix:
    """Red and blue spectra at the nodes, shape (2, nodes), for the :func:`response` `color`."""
    count = len(NODES)
    white = color.sum(1)  # (1, 1, 1) but for the roundings of the standards: 1e-4

    def split(x: Matrix) -> Matrix:
        red, blue = x.reshape(2, count)
        return np.stack([red, 1.0 - red - blue, blue])

    def roughness(x: Matrix) -> tuple[float, Matrix]:
        steps = np.diff(split(x), axis=1)
        slope = 2.0 * (np.pad(steps, ((0, 0), (1, 0))) - np.pad(steps, ((0, 0), (0, 1))))
        return float((steps**2).sum()), np.concatenate([slope[0] - slope[1], slope[2] - slope[1]])

    targets = np.concatenate([[white[0], 0.0, 0.0], [0.0, 0.0, white[2]]])
    linear = np.kron(np.eye(2), color)
    fills = np.hstack([np.eye(count), np.eye(count)])
    found = minimize(
        roughness,
        np.full(2 * count, 1.0 / 3.0),
        jac=True,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * (2 * count),
        constraints=[
            {"type": "eq", "fun": lambda x: linear @ x - targets, "jac": lambda x: linear},
            {"type": "ineq", "fun": lambda x: 1.0 - fills @ x, "jac": lambda x: -fills},
        ],
        options={"maxiter": 1000, "ftol": 1e-14},
    )
    if not found.success:
        raise RuntimeError(found.message)
    return np.asarray(found.x.reshape(2, count), np.float64)


def main() -> None:
    """Print the table and its error."""
    study = Study(__doc__, __file__)
    study.options()
    color = response()
    table = np.clip(np.round(solve(color), DIGITS), 0.0, 1.0)
    for row in table:
        print(", ".join(f"{value:g}" for value in row))
    red, blue = table
    spectra = np.stack([red, 1.0 - red - blue, blue])
    print("smallest green:", spectra[1].min())
    names = ("red", "green", "blue")
    rows = [
        (name, *(f"{v:.6f}" for v in color))
        for name, color in zip(names, spectra @ color.T, strict=True)
    ]
    study.table(("primary", *names), rows)


if __name__ == "__main__":
    main()
