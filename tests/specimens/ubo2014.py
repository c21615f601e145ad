"""Small `.btf` files of the database UBO2014."""

from __future__ import annotations

from collections.abc import Iterable
from random import Random
from typing import Any

from nacre.measured.textures.ubo2014 import ColorModel
from tests.specimens.specimen import NUMBERS, VALUES, Specimen, odd_array
from tests.textures.ubo2014_file import FIELDS, btf_bytes, factors

_COUNTS = (
    "size",
    "version",
    "xml_size",
    "channel_count",
    "name_size",
    "view_count",
    "light_count",
    "width",
    "height",
    "rotation_count",
    "most",
    "k_stated",
    "rows",
    "columns",
)


def _files() -> list[bytes]:
    models = [btf_bytes(model=int(model), scalar=2) for model in ColorModel]
    old = [btf_bytes(version=version) for version in (1, 2, 3)]
    return [btf_bytes(), btf_bytes(swapped=True, scalar=8, cosine=1), *models, *old]


def _sized(count: int) -> Iterable[bytes]:
    for name in _COUNTS:
        yield btf_bytes(**{name: count})


def _valued(value: float) -> Iterable[bytes]:
    """Singular values may be infinite: those of large textures do not fit a half."""
    for name in ("per_mm", "scale", "mean", "matrix"):
        values = FIELDS[name]
        changed = value if name == "per_mm" else (*values[:-1], value)
        yield btf_bytes(**{name: changed}, model=int(ColorModel.PCA))
    yield btf_bytes(rotations=((*FIELDS["rotations"][0][:-1], value),))
    for place in ((value, 0.3), (0.3, value)):
        yield btf_bytes(views=(*FIELDS["views"][:-1], place))
        yield btf_bytes(lights=(*FIELDS["lights"][:-1], place))
    for part in (1, 2):
        for scalar in (2, 4, 8):
            matrices = factors(FIELDS)
            matrices[1][part][1, 1] = value
            for model in ColorModel:
                yield btf_bytes(matrices=matrices, scalar=scalar, model=int(model))


def _rebuilt(_: bytes, random: Random) -> bytes:
    shape: dict[str, Any] = {
        "width": random.choice((1, 2, 5)),
        "height": random.choice((1, 3)),
        "views": tuple(
            (random.random() * 1.5, random.random()) for _ in range(random.choice((1, 4)))
        ),
        "lights": tuple(
            (random.random() * 1.5, random.random()) for _ in range(random.choice((1, 3)))
        ),
        "k": random.choice((1, 1, 2, 3)),
        "swapped": random.random() < 0.3,
    }
    matrices = factors(FIELDS | shape)
    if random.random() < 0.5:
        channel, part = random.randrange(3), random.choice((1, 2))
        matrices[channel][part] = odd_array(random, matrices[channel][part].shape, "<f8")
    changes: dict[str, Any] = {
        "version": random.choice((1, 2, 3, 4)),
        "cosine": random.choice((0, 0, 1)),
        "model": random.choice((*map(int, ColorModel), random.choice(NUMBERS))),
        "scalar": random.choice((2, 4, 8)),
        "most": random.choice((3, 4, 100)),
        "rotations": (),
    }
    if random.random() < 0.3:
        changes["matrix"] = tuple(random.choice(VALUES[:-2]) for _ in range(9))
    return btf_bytes(**shape, **changes, matrices=matrices)


SPECIMENS = {
    "UBO2014": Specimen(
        "paint.btf",
        _files,
        header=590,
        sized=_sized,
        valued=_valued,
        rebuild=_rebuilt,
    ),
}
