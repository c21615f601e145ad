"""Small textures of measured reflectance: NumPy archives, and a list of photographs."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable, Mapping
from random import Random

import numpy as np

from tests.specimens.images import png_bytes
from tests.specimens.specimen import (
    NUMBERS,
    VALUES,
    Array,
    Specimen,
    mutated,
    odd_array,
    odd_shape,
)
from tests.specimens.tables import npy_bytes, npy_rebuilt, promised_shapes

_WI = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
_WO = np.array([[0.0, 0.6, 0.8], [0.0, 0.0, 1.0]])


def archive_bytes(contents: Mapping[str, bytes], method: int = zipfile.ZIP_STORED) -> bytes:
    """An archive of arrays, with checksums that are right."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, content in contents.items():
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), content, method)
    return file.getvalue()


def arrays(dtype: str = "<f2") -> dict[str, Array]:
    """The arrays of a texture of 2 x 3 texels at two pairs of directions."""
    values = np.linspace(0.0, 1.0, 2 * 3 * 2 * 3).reshape(2, 3, 2, 3)
    return {
        "values": values.astype(dtype),
        "wi": _WI.copy(),
        "wo": _WO.copy(),
        "name": np.array("cloth"),
    }


def _files(**replaced: bytes) -> dict[str, bytes]:
    return {name: npy_bytes(array) for name, array in arrays().items()} | replaced


def _sized(count: int) -> Iterable[bytes]:
    for name in ("values", "wi", "wo"):
        for content in promised_shapes(arrays()[name], count):
            yield archive_bytes(_files(**{name: content}))


def _valued(value: float) -> Iterable[bytes]:
    for name, place in (("wi", 4), ("wo", 1), ("values", 7)):
        array = arrays("<f8")[name]
        array.flat[place] = value
        yield archive_bytes(_files(**{name: npy_bytes(array)}))


def _rebuilt(data: bytes, random: Random) -> bytes:
    files = _files()
    name = random.choice(("values", "values", "wi", "wo", "name"))
    choice = random.random()
    if choice < 0.3:
        files[name] = mutated(files[name], random)
    elif choice < 0.5:
        files[name] = npy_rebuilt(random.choice((2, 4)))(data, random)
    elif choice < 0.8:
        shape = (*odd_shape(random, 2), 2, 3)
        values = odd_array(random, shape, random.choice(("<f2", "<f4", "<f8", ">f4")))
        files["values"] = npy_bytes(values)
    elif choice < 0.9:
        del files[name]
    else:
        files["name"] = npy_bytes(np.array("x" * random.choice((0, 1, 1024, 1025, 9000))))
    method = random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2))
    return archive_bytes(files, method)


# Photographs

_LIST = (
    "# a made set\nfile,theta_l,phi_l,theta_v,phi_v,quantity\n"
    "a.png,0,0,30,90,reflectance\nb.png,{value},15,45,7.5,radiance\n"
)
_VECTORS = "vx;vy;vz;file;lx;ly;lz\n0;0.6;0.8;a.png;0;0;1\n0.8;0;0.6;b.png;{value};0;0.8\n"


def _list_rebuilt(_: bytes, random: Random) -> bytes:
    value = random.choice((*VALUES, *NUMBERS, "", "x", "٣", "1_0", '"', "a.png", "../a.png"))
    text = random.choice((_LIST, _VECTORS)).replace("{value}", "0.6")
    cells = text.split(mark := random.choice((",", ";", "\n")))
    cells[random.randrange(len(cells))] = str(value)
    return mark.join(cells).encode()


_PIXELS = np.arange(2 * 3 * 3, dtype="u1").reshape(2, 3, 3)

SPECIMENS = {
    "NumPy archive of a BTF": Specimen(
        "cloth.npz",
        lambda: [
            archive_bytes(_files()),
            archive_bytes(_files(), zipfile.ZIP_DEFLATED),
            archive_bytes({name: npy_bytes(a) for name, a in arrays("<f4").items()}),
        ],
        header=200,
        sized=_sized,
        valued=_valued,
        rebuild=_rebuilt,
        memory=256 << 20,  # a large table may pack into a small archive
    ),
    "photographs": Specimen(
        "directions.csv",
        lambda: [_LIST.format(value=20).encode(), _VECTORS.format(value=0.6).encode()],
        header=60,
        sized=lambda _: [],
        valued=lambda value: [text.format(value=value).encode() for text in (_LIST, _VECTORS)],
        rebuild=_list_rebuilt,
        text=True,
        companions={
            "a.png": png_bytes(_PIXELS, 3, 2),
            "b.png": png_bytes(_PIXELS[::-1], 3, 2),
        },
        module="mitsuba",
    ),
}
