"""Lists and descriptions that people write: directions, plans, recipes, BSDFs of Mitsuba."""

from __future__ import annotations

import json
from pathlib import Path

from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.textures.direction_list import named_directions
from nacre.measuring.bsdf import described_bsdf
from nacre.spectra import rgb_weights
from nacre.textures.capture.recipe import find
from tests.fuzz.damage import json_damage, words_damage
from tests.fuzz.readers import reader
from tests.reading import check_values

_DIRECTIONS = (
    b"# made\ntheta_l,phi_l,theta_v,phi_v\n0,0,30,90\n20,15,45,7.5\n",
    b"lx;ly;lz;vx;vy;vz\n0;0;1;0;0.6;0.8\n",
    b"theta\tphi\n0\t0\n30\t45\n",
)
_PLAN = (
    b"# name: red paint\n# units: degrees\ntheta_i,phi_i,theta_o,phi_o,r,g,b\n"
    b"10,0,30,180,0.3,0.2,0.1\n20,0,30,90,,,\n60,0,60,180,0.5,0.4,0.4\n",
)
_RECIPES = (
    b'{"family": "fabric", "seed": 3, "parameters": {}}',
    b'{"family": "wood"}',
)
_BSDFS = (
    {"type": "roughplastic", "diffuse_reflectance": {"type": "rgb", "value": [0.1, 0.2, 0.3]}},
    {"type": "principled", "roughness": 0.3, "metallic": 1.0, "anisotropic": 0.5},
    {
        "type": "blendbsdf",
        "weight": 0.3,
        "a": {"type": "diffuse"},
        "b": {"type": "roughconductor", "material": "Al", "alpha_u": 0.1, "alpha_v": 0.3},
    },
    {"type": "twosided", "a": {"type": "roughplastic", "alpha": 0.2}},
)
_COLUMNS = ("theta", "phi", "lx", "vz", "theta_l", "file", ";", "\t", "#", '"', "\n", "nm", "f")


def _read_directions(path: Path) -> None:
    wi, wo = named_directions(str(path))
    assert wi.shape == wo.shape
    assert (wi[:, 2] > 0.0).all()


def _plans() -> list[bytes]:
    rgb_weights([500.0])  # a column may be a wavelength: the first loads a library, once
    return [*_PLAN]


def _read_plan(path: Path) -> None:
    found = load_brdf(path)
    assert isinstance(found, ScatteredBrdf)
    assert len(found.samples) > 0
    check_values(found)


def _read_recipe(path: Path) -> None:
    find(path).build(16)


def _read_bsdf(path: Path) -> None:
    try:
        text = path.read_text("utf-8")
    except UnicodeDecodeError as error:
        raise NacreError(f"{path}: is no text") from error
    check_values(described_bsdf(text, str(path)))


def _described() -> list[bytes]:
    return [json.dumps(bsdf).encode() for bsdf in _BSDFS]


READERS = (
    reader(
        "list of directions", "a.csv", lambda: [*_DIRECTIONS],
        words_damage(lambda: _DIRECTIONS, _COLUMNS), _read_directions,
    ),
    reader(
        "plan of measurements", "a.csv", _plans,
        words_damage(lambda: _PLAN, _COLUMNS), _read_plan,
    ),
    reader(
        "recipe of a surface", "a.json", lambda: [*_RECIPES],
        json_damage(lambda: _RECIPES), _read_recipe, memory=256 << 20,
    ),
    reader(
        "described BSDF", "a.json", _described, json_damage(_described), _read_bsdf
    ),
)  # fmt: skip
