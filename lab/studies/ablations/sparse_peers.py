"""Peers for few measurements: what makes a material of them, and where they are taken.

Both peers are our own implementations of what papers describe. All know the same 64 published MERL
networks, those that the benchmark's split `merl-networks-0` trains on. Materials judged are its 16
others and the measured RGL tables, or with `--measured` all tables in a folder. Pictures have 32 x
32 pixels with 64 directions of light.

What makes a material of samples:

- the prior of nacre, as in `nacre fit` of a file with few samples;
- a set encoder with a hypernetwork (:mod:`nacre_lab.sparse.set_encoder`).

Where samples are taken:

- `random`: uniform in the Rusinkiewicz angles, others for each material;
- `plan`: `nacre measure plan`, for pictures of spheres under lamps of many sizes;
- `f_r`: the same for f_r at single pairs of directions in place of pictures;
- `sharp`: the same for lamps down to small bulbs;
- `studio`: the same for pictures in the included studio and in directional light, as judged;
- `regression`: for the same pictures, by a regression over materials drawn from the prior;
- `encoder`: for the same pictures, by what the set encoder makes of training materials.

PSNR in dB, means over materials (worst): in the studio, in the museum, which no choice knows, and
in directional light. Results are kept, so that a stopped run goes on; so is the set encoder's
training, below the folder of results.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lab.studies.ablations.few_samples import Directions, random_pairs
from lab.studies.study import Study, log, museum, progress, rgl_tables
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.io.files import digest
from nacre.latent import NeuralBasis
from nacre.measuring import Design, Exposures, Instrument
from nacre.measuring.design import VIEWS
from nacre.mitsuba.sphere import render_sphere, standard_lights
from nacre.numerics.direction_samples import DirectionSamples
from nacre.sampling.lit_views import LitViews, lit_views
from nacre_lab.benchmark.splits import find_split
from nacre_lab.reproduce.cache import Cache, cache_key, module_digest
from nacre_lab.reproduce.codes import CodeSettings, bases
from nacre_lab.sparse.choices import by_regression, single_pairs, sphere_views, through_encoder
from nacre_lab.sparse.set_encoder import SetEncoder
from nacre_lab.sparse.set_encoder_training import RECIPE, set_encoder

SPLIT = "merl-networks-0"
COUNTS = 8, 16, 40, 160
CHOICES = "random", "plan", "sharp", "studio", "f_r", "regression", "encoder"
FARTHEST = {"f_r": 16, "regression": 16, "encoder": 16, "sharp": 40, "studio": 40}
"""The most samples of choices that take long."""
LIGHTS = "studio", "museum", "directional"
SIZE, DIRECTIONS = 32, 64
SHARPNESS = 3.0, 2000.0
"""Of lamps, from a third of the sky to small bulbs; a plan has them up to 60."""
SHOWN_TO = 16
"""Training materials that pairs for the set encoder are chosen on."""


class Pictures:
    """The lights of the study, and PSNR under each."""

    def __init__(self) -> None:
        own, other = (standard_lights(light, DIRECTIONS) for light in (None, museum()))
        self._lights = own["environment"], other["environment"], own["directional"]

    def of(self, brdf: Brdf) -> list[np.ndarray]:
        """Displayed values of the pixels of a sphere under each light."""
        found = (render_sphere(brdf, light, SIZE) for light in self._lights)
        return [tone_map(image)[mask].astype(np.float64) for image, mask in found]

    def psnr(self, truth: Sequence[np.ndarray], other: Brdf) -> list[float]:
        """In dB, under each light."""
        pairs = zip(truth, self.of(other), strict=True)
        return [-10.0 * math.log10(np.square(a - b).mean() + 1e-12) for a, b in pairs]


def planned(
    basis: NeuralBasis, exposures: Exposures, lit: LitViews | None, count: int
) -> list[int]:
    """Pairs of :class:`nacre.measuring.Design`, for some pictures."""
    design = Design(basis, basis.examples, exposures, lit=lit)
    for index in range(count):
        design.choose()
        progress("planning", index + 1, count, "")
    return design.chosen


class Choices:
    """Pairs of directions by name; what is the same for all materials is made once and kept."""

    def __init__(
        self,
        basis: NeuralBasis,
        encoder: SetEncoder | None,
        training: Sequence[Path],
        most: int,
        cache: Cache,
        seed: int,
    ) -> None:
        self._basis, self._encoder, self._training = basis, encoder, training
        self._most, self._cache, self._seed = most, cache, seed
        self._code = module_digest(*_CODE)
        self.exposures = Instrument().exposures()

    @property
    def names(self) -> list[str]:
        """Of what there is."""
        return [name for name in CHOICES if name != "encoder" or self._encoder]

    def most(self, name: str) -> int:
        """The most pairs of a choice."""
        return min(self._most, FARTHEST.get(name, self._most))

    def key(self, name: str) -> str:
        """What the choice follows from."""
        known = facts(self._encoder) if name == "encoder" else self._basis.fingerprint()
        return cache_key("choice", [name, known, self.most(name), self._seed, self._code])

    def pairs(self, name: str, material: int) -> Directions:
        """The pairs for a material, most important first where they were planned."""
        if name == "random":
            return random_pairs(self.most(name), 1000 * self._seed + material)
        found = self._cache.arrays(self.key(name), ["chosen"], lambda: {"chosen": self._made(name)})
        return tuple(w[found["chosen"], 0] for w in (self.exposures.wi, self.exposures.wo))

    def _made(self, name: str) -> np.ndarray:
        count, exposures = self.most(name), self.exposures
        log("choosing", name)
        if name == "regression":
            lit = sphere_views()
            return np.array(by_regression(self._basis, exposures, lit, count, self._seed))
        if name == "encoder":
            step = max(1, len(self._training) // SHOWN_TO)
            shown = [load_brdf(path) for path in self._training[::step]]
            small = sphere_views(size=7, directions=12)
            given = self._encoder, shown, exposures, small, count, self._seed
            return np.array(through_encoder(*given))
        views: dict[str, Callable[[], LitViews | None]] = {
            "plan": lambda: None,
            "sharp": lambda: lit_views(1, VIEWS, sharpness=SHARPNESS),
            "studio": sphere_views,
            "f_r": lambda: single_pairs(2048, 1),
        }
        return np.array(planned(self._basis, exposures, views[name](), count))


_CODE = "sparse/choices.py", "measuring/design.py", "measuring/instrument.py"


class Known(NamedTuple):
    """What makes a material of samples, and what it follows from."""

    make: Callable[[DirectionSamples], Brdf]
    facts: object


def known_by(basis: NeuralBasis, encoder: SetEncoder | None) -> dict[str, Known]:
    """What there is to make materials of samples, by name."""
    found = {"nacre": Known(lambda s: basis.decode(basis.encode(s)), basis.fingerprint())}
    if encoder is not None:
        found["set encoder"] = Known(lambda s: encoder.decode(encoder.encode(s)), facts(encoder))
    return found


def facts(encoder: SetEncoder) -> float:
    """A number that differs between trained encoders."""
    return float(sum(np.square(weights).sum(dtype=float) for weights, _ in encoder.encoder))


def tables(paths: Sequence[Path]) -> list[Path]:
    """The files of isotropic materials; a line on standard error for each of the others."""
    found = []
    for path in paths:
        try:
            brdf = load_brdf(path)
        except NacreError as error:
            log(f"skipped: {error}")
            continue
        if brdf.isotropic:
            found.append(path)
        else:
            log(f"skipped: {path} is anisotropic")
    return found


def judged(
    path: Path,
    index: int,
    makers: Mapping[str, Known],
    choices: Choices,
    counts: Sequence[int],
    pictures: Pictures,
    cache: Cache,
) -> dict[tuple[int, str, str], list[float]]:
    """PSNR under each light, by the number of samples, the choice, and what makes the material."""
    truth, hashed = load_brdf(path), digest(path)
    seen: list[np.ndarray] = []
    found = {}
    for count in counts:
        for name in choices.names:
            if count > choices.most(name):
                continue
            wi, wo = (w[:count] for w in choices.pairs(name, index))
            known = truth.valid(wi, wo)
            samples = DirectionSamples(wi[known], wo[known], truth.eval(wi, wo)[known])
            for maker, (make, origin) in makers.items():
                about = [hashed, count, origin, choices.key(name), SIZE, DIRECTIONS]
                about += [index] if name == "random" else []

                def errors(make: Any = make, samples: Any = samples) -> dict[str, list[float]]:
                    seen.extend([] if seen else pictures.of(truth))
                    return {"psnr": pictures.psnr(seen, make(samples))}

                values = cache.arrays(cache_key("sparse", about), ["psnr"], errors)["psnr"]
                found[count, name, maker] = [float(value) for value in values]
    return found


def main() -> None:
    """Print one table for each group of materials."""
    study = Study(__doc__, __file__)
    study.add_argument("--measured", type=Path, help="folder of tables to judge in place of others")
    study.add_argument("--counts", type=int, nargs="*", default=COUNTS, help="samples")
    study.add_argument("--steps", type=int, default=RECIPE.steps, help="of the set encoder")
    study.add_argument("--without-encoder", action="store_true", help="no set encoder")
    options = study.options()
    split = find_split(SPLIT)
    training = [split.path(name) for name in split.training]
    groups = {
        "held-out networks": [split.path(name) for name in split.materials],
        "RGL tables": [] if options.measured else rgl_tables(),
    }
    if options.measured:
        if not options.measured.is_dir():
            raise SystemExit(f"{options.measured} is not a folder")
        files = sorted(path for path in options.measured.iterdir() if path.is_file())
        groups = {options.measured.name: tables(files)}
        if not groups[options.measured.name]:
            raise SystemExit(f"{options.measured} holds no isotropic material that nacre reads")
    settings = CodeSettings(seed=options.seed)
    recipe = replace(RECIPE, steps=options.steps, seed=options.seed)
    if options.quick:
        settings, recipe = settings.quick(), replace(recipe, steps=min(recipe.steps, 200))
        training = training[:8]
    basis = bases(training, ["neural"], settings, study.cache, progress)["neural"]
    assert isinstance(basis, NeuralBasis)
    encoder = None
    if not options.without_encoder:
        encoder = set_encoder(training, recipe, study.cache, progress)
    counts = study.few(options.counts, 1)
    choices = Choices(basis, encoder, training, max(counts), study.cache, options.seed)
    makers, pictures = known_by(basis, encoder), Pictures()
    for group, paths in groups.items():
        results = []
        for index, path in enumerate(study.few(paths)):
            given = makers, choices, counts, pictures, study.cache
            results.append(judged(path, index, *given))
            log(group, index + 1, "of", len(paths), path.stem)
        rows = []
        for count, name, maker in results[0]:
            values = np.array([each[count, name, maker] for each in results])
            mean, worst = values.mean(axis=0), values.min(axis=0)
            cells = [f"{m:.1f} ({w:.1f})" for m, w in zip(mean, worst, strict=True)]
            rows.append((str(count), name, maker, *cells))
        columns = "samples", "taken", "made by", *LIGHTS
        study.table(columns, rows, f"{group} seed {options.seed}", "PSNR in dB, mean (worst).")


if __name__ == "__main__":
    main()
