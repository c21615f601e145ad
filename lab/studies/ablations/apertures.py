"""How well a detector of 5 degrees is undone, on scans that are simulated.

A goniometer with a detector 5 degrees wide (half the angle: 2.5) and a source of 0.5 degrees
measures surfaces that are known: 8 incidences, views every degree within 10 degrees of the mirror
direction and every 5 elsewhere in the plane of incidence, and 9 lines across it. Each value is the
mean of f_r over both cones, by a product rule that nacre does not use. With noise, each value errs
by 2 % and 0.2 % of the median value (standard deviations), which the scan knows.

Columns: the error of f_r at the samples near the mirror direction (f_r above a fifth of its
highest of an incidence, up to 65 degrees; root mean square of ln f / truth), in the values as
measured and as nacre takes them; the
height of the highlight relative to the truth in networks that ignore and that undo the apertures,
the mean over 5 incidences; and the PSNR of a sphere in directional light.

Run `python -m lab.studies.ablations.apertures`; `--half 5` takes a detector twice as wide.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import nacre
from lab.studies.study import Study, log, rgl_tables
from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join
from nacre.measured import ScatteredBrdf
from nacre.metrics import compare

Matrix = npt.NDArray[np.float64]

LIGHTS = 5, 15, 25, 35, 45, 55, 65, 75
ROUGHNESSES = 0.1, 0.05, 0.03
TABLES = "satin_rosaline", "cc_ibiza_sunset", "cg_sunflower"
SOURCE = 0.25
NOISES = 0.0, 0.02
COLUMNS = (
    *("material", "noise", "near the mirror: as measured", "undone"),
    *("height of the highlight: ignored", "undone", "PSNR in dB: ignored", "undone"),
)


def directions() -> tuple[Matrix, Matrix]:
    """Pairs of the goniometer, shapes (n, 3)."""
    rows = []
    for light in LIGHTS:
        near = np.arange(-10.0, 10.5) + light
        views = np.unique(np.concatenate([near, np.arange(-75.0, 80.0, 5.0)]))
        rows += [
            (light, abs(view), 180.0 if view >= 0.0 else 0.0) for view in views if view <= 80.0
        ]
        rows += [
            (light, view, 180.0 - side)
            for side in (4, 8, 12, 20, 40, 60, 90, 120, 150)
            for view in LIGHTS
        ]
    light, view, phi = np.radians(np.array(rows, np.float64)).T
    wi, wo = join(from_spherical(light, 0.0 * light)), join(from_spherical(view, phi))
    return wi.astype(np.float64), wo.astype(np.float64)


def cone(axis: Matrix, half: float, rings: int, turns: int) -> tuple[Matrix, Matrix]:
    """Directions in cones about axes, (n, rings x turns, 3), and their solid angles."""
    x, w = np.polynomial.legendre.leggauss(rings)
    cosine = 1.0 - (1.0 - np.cos(half)) * 0.5 * (x + 1.0)
    phi = 2.0 * np.pi * (np.arange(turns) + 0.5) / turns
    across = np.cross(axis, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    third = np.cross(axis, across)
    sine = np.sqrt(1.0 - cosine**2)
    a = np.outer(sine, np.cos(phi)).reshape(-1)
    b = np.outer(sine, np.sin(phi)).reshape(-1)
    c = np.repeat(cosine, turns)
    found = sum(s[None, :, None] * v[:, None] for s, v in ((a, across), (b, third), (c, axis)))
    return np.asarray(found), np.repeat(w, turns)


def measured(truth: Brdf, wi: Matrix, wo: Matrix, half: float) -> Matrix:
    """Means of f_r over both apertures, shape (n, 3)."""
    values = np.empty((len(wi), 3))
    for start in range(0, len(wi), 64):
        part = slice(start, start + 64)
        light, a = cone(wi[part], np.radians(SOURCE), 2, 6)
        view, b = cone(wo[part], np.radians(half), 12, 24)
        f = truth.eval(light[:, :, None], view[:, None])
        seen = b * np.maximum(view[..., 2], 0.0)
        total = np.einsum("i,nj,nijc->nc", a, seen, f)
        values[part] = total / (a.sum() * seen.sum(axis=1))[:, None]
    return values


def highlight(wi: Matrix, exact: Matrix) -> npt.NDArray[np.bool_]:
    """Samples near the mirror direction of incidences up to 65 degrees."""
    level = exact.mean(axis=1)
    lights = np.round(np.degrees(np.arccos(wi[:, 2])))
    highest = {light: level[lights == light].max() for light in LIGHTS}
    top = np.array([highest[light] for light in lights])
    return np.asarray((level > 0.2 * top) & (lights < 70.0))


def height(truth: Brdf, fitted: Brdf) -> float:
    """The highest f_r near the mirror direction relative to the truth, mean over incidences."""
    ratios = []
    for light in (15.0, 25.0, 35.0, 45.0, 55.0):
        view = np.radians(np.linspace(light - 8.0, light + 8.0, 641))
        wi = join(from_spherical(np.radians(light), 0.0))
        wo = join(from_spherical(view, np.pi + 0.0 * view))
        a, b = (brdf.eval(wi, wo).mean(axis=-1).max() for brdf in (fitted, truth))
        ratios.append(a / b)
    return float(np.mean(ratios))


def main() -> None:
    """Print one table."""
    study = Study(__doc__, __file__)
    study.add_argument("--half", type=float, default=2.5, help="half the detector's angle, degrees")
    study.add_argument("--preset", default="standard", help="of the fits")
    options = study.options()
    preset = "draft" if options.quick else options.preset
    base = {"diffuse": (0.1, 0.12, 0.2), "specular": (0.05, 0.05, 0.05)}
    materials = [MODELS["ggx"](**base, roughness=a, name=f"GGX, {a:g}") for a in ROUGHNESSES]
    materials += [nacre.load(path) for name in TABLES for path in rgl_tables(f"{name}*")]
    wi, wo = directions()
    rows = []
    for truth in materials:
        exact, wide = truth.eval(wi, wo).astype(np.float64), measured(truth, wi, wo, options.half)
        near = highlight(wi, exact)
        for noise in NOISES:
            sigma = noise * (wide.mean(axis=1) + 0.1 * np.median(wide))
            random = np.random.default_rng(options.seed)
            values = wide + sigma[:, None] * random.normal(size=(len(wi), 1))
            known = {"sigma": sigma} if noise else {}
            scan = ScatteredBrdf(wi, wo, values, truth.name, **known)
            scans = scan, scan.through(SOURCE, options.half)
            errors = [_error(each, exact, near) for each in scans]
            fits = [nacre.fit(each, preset, seed=options.seed) for each in scans]
            heights = [height(truth, fitted) for fitted in fits]
            shown = [{r[:2]: r[2] for r in compare(truth, f).rows()} for f in fits]
            psnr = [figures["directional", "PSNR (dB)"] for figures in shown]
            rows.append(
                (
                    truth.name,
                    f"{noise:.0%}",
                    *(f"{e:.3f}" for e in errors),
                    *(f"{h:.2f}" for h in heights),
                    *(f"{p:.1f}" for p in psnr),
                )
            )
            log(*rows[-1])
    study.table(COLUMNS, rows)


def _error(scan: ScatteredBrdf, exact: Matrix, near: npt.NDArray[np.bool_]) -> float:
    taken = scan.scattered()
    assert taken is not None
    ratio = np.log(np.maximum(taken.samples.rgb[near], 1e-6) / exact[near])
    return float(np.sqrt(np.square(ratio).mean()))


if __name__ == "__main__":
    main()
