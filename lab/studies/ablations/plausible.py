"""What the density of codes and the named directions are worth, on materials they never saw.

Every published network of an isotropic material is a material. A seeded fifth of them is held out,
the others give a neural basis (:mod:`nacre.latent`), whose density of codes and named directions
are then judged:

- density: log densities of codes of the held-out materials, beside those of the training materials
  (each without itself) and of random codes;
- samples: chi-square of albedo and gloss of drawn materials against those of the training set, in
  fifths of the latter: of `nacre latent sample`, of the density alone, of its parts about the
  training materials with their channels as they are, and of normal codes;
- projection: pictures of held-out materials whose codes have noise, before and after
  :meth:`nacre.latent.Prior.project`;
- directions: what amounts from -2 to 2 along each named direction do to the parameters of GGX
  fitted to held-out materials.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.stats import chi2_contingency, multivariate_normal, spearmanr

import nacre
from lab.studies.study import Study, data, log, museum, progress
from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join
from nacre.latent import NeuralBasis
from nacre.latent.basis import CodedBrdf
from nacre.latent.edits import Edit, Traits, edits, traits
from nacre.metrics import albedo, compare, delta_itp
from nacre.workflows import draw_materials, project_material
from nacre_lab.reproduce.codes import CodeSettings, bases, split

AMOUNTS = (-2.0, -1.0, 0.0, 1.0, 2.0)
NOISE = 0.5, 1.0
"""Standard deviations of what is added to codes."""
SAMPLES = 6_000
"""Of fits by which directions are judged: twice as many as they are found by."""
GLOSS_ANGLES = tuple(np.radians([20.0, 60.0]))
"""Polar angles of gloss meters."""
TRAIT = {
    "rougher": ("roughness", 1.0),
    "glossier coat": ("coat", 1.0),
    "darker": ("base", -1.0),
    "more saturated": ("saturation", 1.0),
    "more metallic": ("metalness", 1.0),
}
"""What each direction is to change, and which way."""
SHARP = np.log(0.02)
"""Of alpha: sharper highlights do not widen."""
BINS = 5


def appearance(material: Brdf) -> tuple[float, float, float]:
    """Logarithms of albedo along the normal, of gloss at 20 and at 60 degrees, channels averaged.

    Gloss is f_r in the mirror direction.
    """
    level = albedo(material, [0.0], count=256).value.mean()
    gloss = []
    for angle in GLOSS_ANGLES:
        wi, wo = (join(from_spherical(np.array([angle]), np.array([phi]))) for phi in (0.0, np.pi))
        gloss.append(float(material.eval(wi, wo).mean()))
    low, high = (float(np.log(max(value, 1e-6))) for value in gloss)
    return float(np.log(max(level, 1e-6))), low, high


def densities(basis: NeuralBasis, held_out: Floats, seed: int) -> list[tuple[str, ...]]:
    """Lines on log densities of codes: of each kind, and how many are plausible."""
    prior, level = basis.prior, basis.prior.level()
    random = np.random.default_rng((seed, 1))
    normal = random.normal(size=(1000, basis.code_dim))
    shuffled = random.permuted(np.asarray(basis.examples, np.float64), axis=0)
    rows = {
        "training, each without itself": np.asarray(basis.examples, np.float64),
        "held out": held_out,
        "normal codes of the same covariance": normal,
        "values of training codes, shuffled": shuffled,
    }
    found = []
    for name, codes in rows.items():
        logs = prior.left_out() if name.startswith("training") else prior.log_density(codes)
        own = multivariate_normal(np.zeros(basis.code_dim)).logpdf(codes)
        plausible = f"{100.0 * (logs >= level).mean():.0f} %"
        means = f"{logs.mean():.1f}", f"{np.median(logs):.1f}", f"{np.mean(own):.1f}"
        found.append((f"seed {seed}: {name}", *means, plausible))
    return found


def chi_squares(basis: NeuralBasis, seed: int, count: int) -> list[tuple[str, ...]]:
    """Lines on chi-square of drawn materials against the training materials."""
    prior = basis.prior
    random = np.random.default_rng((seed, 2))
    own = np.arange(len(basis.examples))
    truth = np.array([appearance(basis.decode(code)) for code in basis.examples])
    drawn: dict[str, Sequence[CodedBrdf]] = {
        "nacre latent sample": draw_materials(basis, count, seed=seed),
        "density": [basis.decode(c) for c in prior.sample(count, seed)],
        "about the training materials": [basis.decode(c) for c in prior.sample(count, seed, own)],
        "normal codes": [basis.decode(c) for c in random.normal(size=(count, basis.code_dim))],
    }
    rows = []
    for name, materials in drawn.items():
        found = np.array([appearance(material) for material in materials])
        cells = []
        for mine, theirs in zip(found.T, truth.T, strict=True):
            edges = np.quantile(theirs, np.arange(1, BINS) / BINS)
            tables = [
                np.bincount(np.searchsorted(edges, values), minlength=BINS)
                for values in (mine, theirs)
            ]
            result = chi2_contingency(np.array(tables))
            cells.append(f"{result.statistic:.1f} ({_probability(result.pvalue)})")
        light = f"{100.0 * (found[:, 0] > 0.0).mean():.0f} %"
        rows.append((f"seed {seed}: {name}", *cells, light))
        log(*rows[-1])
    return rows


def projections(
    basis: NeuralBasis, held_out: Sequence[Path], codes: Floats, seed: int
) -> list[tuple[str, ...]]:
    """Lines on pictures of materials from codes, codes with noise, and these projected."""
    random = np.random.default_rng((seed, 3))
    kinds: dict[str, list[tuple[float, ...]]] = {}
    for path, code in zip(held_out, codes, strict=True):
        truth = nacre.load(path)
        made = {"code": basis.decode(code)}
        for deviation in NOISE:
            noisy = basis.decode(code + deviation * random.normal(size=code.shape))
            made[f"noise of {deviation:g}"] = noisy
            made[f"noise of {deviation:g}, projected"] = project_material(noisy)
        for name, material in made.items():
            found = compare(truth, material, environment=museum(), size=64, directions=96)
            figures = [float(np.linalg.norm(material.code - code))]
            for light in found.lights:
                e, itp = light.errors, delta_itp(light.truth, light.other)[found.mask].mean()
                figures += [e.mae, e.ssim, e.psnr, e.flip, float(itp)]
            kinds.setdefault(name, []).append(tuple(figures))
    rows = []
    for name, figures_of in kinds.items():
        distance, *mean = np.mean(figures_of, axis=0)
        cells = [
            f"{mae:.4f} / {ssim:.3f} / {psnr:.1f} / {flip:.4f} / {itp:.1f}"
            for mae, ssim, psnr, flip, itp in (mean[:5], mean[5:])
        ]
        rows.append((f"seed {seed}: {name}", f"{distance:.2f}", *cells))
    return rows


def judged(
    basis: NeuralBasis, known: dict[str, Edit], codes: Floats
) -> dict[str, list[list[Traits]]]:
    """Traits of materials at the amounts along each direction."""
    found: dict[str, list[list[Traits]]] = {}
    for name, edit in known.items():
        found[name] = [
            [traits(basis.decode(edit.apply(code, a)), SAMPLES) for a in AMOUNTS] for code in codes
        ]
        log("judged", name)
    return found


def trait_of(traits: Traits, name: str) -> float:
    """A trait; saturation is how colored the base is, metalness how much more the coat reflects."""
    if name == "metalness":
        return traits.coat - traits.base
    if name == "saturation":
        return float(np.linalg.norm(traits.base_color))
    return float(getattr(traits, name))


def direction_rows(found: dict[str, list[list[Traits]]]) -> list[tuple[str, ...]]:
    """Lines on how surely directions do what they are called, and what else they do."""
    rows = []
    for name, materials in found.items():
        trait, sign = TRAIT[name]
        wide = [m for m in materials if m[len(AMOUNTS) // 2].roughness > SHARP]
        for about, chosen in (("", materials), (", alpha above 0.02", wide)):
            if about and trait != "roughness":
                continue
            values = np.array([[sign * trait_of(step, trait) for step in m] for m in chosen])
            rank = np.mean([spearmanr(AMOUNTS, row).statistic for row in values])
            steps = np.diff(values, axis=1)
            others = [
                f"{np.median([abs(m[3][k] - m[2][k]) for m in chosen]):.2f}" for k in range(3)
            ]
            rows.append(
                (
                    f"{name}{about}",
                    str(len(chosen)),
                    f"{100.0 * (steps > 0.0).mean():.0f} %",
                    f"{100.0 * (steps > 0.0).all(axis=1).mean():.0f} %",
                    f"{rank:.2f}",
                    f"{np.median(steps):.2f}",
                    *others,
                )
            )
    return rows


def main() -> None:
    """Print the tables."""
    study = Study(__doc__, __file__)
    study.add_argument("folder", nargs="?", type=Path, help="networks; the published ones")
    study.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="of splits")
    study.add_argument("--count", type=int, default=400, help="materials drawn")
    options = study.options()
    folder = options.folder or data("pretrained")
    files = study.few(sorted(folder.rglob("*.h5")), 20)
    count = 60 if options.quick else options.count
    of_density, of_samples, of_projection = [], [], []
    of_directions: dict[str, list[list[Traits]]] = {}
    for seed in study.few(options.seeds, 1):
        settings = CodeSettings(seed=seed)
        training, held_out = split(files, seed)
        settings = settings.quick() if options.quick else settings
        basis = bases(training, ["neural"], settings, study.cache, progress)["neural"]
        assert isinstance(basis, NeuralBasis)
        codes = np.array([basis.encode(nacre.load(path)) for path in held_out])
        of_density += densities(basis, codes, seed)
        of_samples += chi_squares(basis, seed, count)
        of_projection += projections(basis, held_out, codes, seed)
        for name, found in judged(basis, edits(basis, progress), codes).items():
            of_directions.setdefault(name, []).extend(found)
    columns = "mean log density", "median", "mean if codes were normal", "plausible"
    study.table(("codes", *columns), of_density, "density")
    looks = "albedo", "gloss at 20°", "gloss at 60°", "albedo above 1"
    note = f"Chi-square of 4 degrees of freedom (p), of {count} draws against the training set."
    study.table(("drawn", *looks), of_samples, "samples", note)
    lights = [
        f"{light}: MAE / SSIM / PSNR / FLIP / ΔE_ITP" for light in ("environment", "directional")
    ]
    study.table(("held out", "distance", *lights), of_projection, "projection")
    moves = "steps the right way", "whole ways", "rank correlation", "median step"
    changed = "roughness", "coat", "base"
    study.table(
        ("direction", "materials", *moves, *changed), direction_rows(of_directions), "directions"
    )


def _probability(p: float) -> str:
    return f"p = {p:.2f}" if p >= 0.005 else f"p = {p:.0e}"


if __name__ == "__main__":
    main()
