"""What every reader promises of every file, damaged or not."""

from __future__ import annotations

import itertools
import json
import math
import tracemalloc
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.files import HEAD, Format, FormatError, MissingExtraError
from nacre.measured import ScatteredBrdf
from tests.specimens import Specimen


def _directions() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Pairs of directions from the normal to the horizon and below."""
    cosines = (1.0, 0.9, 0.5, 0.05, 1e-4, 0.0, -0.3)
    w = [
        (math.sqrt(1.0 - z * z) * math.cos(phi), math.sqrt(1.0 - z * z) * math.sin(phi), z)
        for z, phi in itertools.product(cosines, (0.0, 2.0))
    ]
    wi, wo = zip(*itertools.product(w, w), strict=True)
    return np.array(wi), np.array(wo)


WI, WO = _directions()


def check_reading(entry: Format, specimen: Specimen, path: Path, again: Path) -> tuple[bool, int]:
    """Read a file that may be damaged, and use what comes of it.

    Parameters
    ----------
    entry
        The format to read it as.
    specimen
        Of that format.
    path
        The file; nothing else may appear or change beside it.
    again
        A file in another folder, to which what was read is written where the format can be.

    Returns
    -------
    loaded
        Whether the file was read; else a :class:`FormatError` was raised, as is proper.
    peak
        Bytes allocated at once, beyond those before; measured if `tracemalloc` is on.

    Raises
    ------
    AssertionError
        If a promise is broken. Any other exception is one that the reader must not raise.
    """
    data = path.read_bytes()
    before = _listing(path.parent)
    if entry.recognise is not None:
        assert entry.recognise(data[:HEAD]) in (True, False)
    start = tracemalloc.get_traced_memory()[0]
    tracemalloc.reset_peak()
    try:
        material: Brdf | Btf | None = entry.load(path)
    except MissingExtraError:
        material = None
    except FormatError as error:
        material = None
        _check_message(str(error), path)
    if isinstance(material, Btf):
        check_texture(material)
    elif material is not None:
        check_values(material)
    peak = tracemalloc.get_traced_memory()[1] - start
    whole = len(data) + sum(map(len, specimen.companions.values()))
    assert peak <= 8 * whole + specimen.memory, f"{peak} bytes of memory for {whole} of file"
    if isinstance(material, Brdf) and entry.save is not None:
        _check_writing(entry, material, again)
    assert _listing(path.parent) == before, "reading changed the folder"
    return material is not None, peak


def check_values(brdf: Brdf) -> None:
    """Values are finite and of the right shape, and facts can be shown and stored."""
    json.dumps(brdf.describe(), ensure_ascii=False).encode()
    assert isinstance(brdf.name, str)
    for dtype in (np.float32, np.float64):
        wi, wo = np.asarray(WI, dtype), np.asarray(WO, dtype)
        values, valid = brdf.eval(wi, wo), brdf.valid(wi, wo)
        assert values.shape == (len(wi), 3)
        assert values.dtype == dtype
        assert np.isfinite(values).all(), "f_r is not finite"
        assert (values >= 0.0).all()
        above = (WI[:, 2] > 0.0) & (WO[:, 2] > 0.0)
        assert (values[~above] == 0.0).all()
        assert valid.shape == (len(wi),)
        assert valid.dtype == np.bool_
        assert not valid[~above].any()


def check_texture(btf: Btf) -> None:
    """Values are finite, of the right shape and the same in texels as in images."""
    assert isinstance(btf.name, str)
    for directions in (btf.wi, btf.wo):
        assert directions.shape == (btf.pair_count, 3)
        assert directions.dtype == np.float32
        assert (directions[:, 2] > 0.0).all()
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-6)
    last = np.array([btf.texel_count - 1])
    texel, image = btf.texels(last), btf.images(slice(0, 1))
    assert texel.shape == (1, btf.pair_count, 3)
    assert image.shape == (1, btf.height, btf.width, 3)
    assert texel.dtype == image.dtype == np.float32
    for values in (texel, image):
        assert np.isfinite(values).all(), "a value is not finite"
        assert (values >= 0.0).all()
    np.testing.assert_allclose(image[0, -1, -1], texel[0, 0], rtol=1e-3, atol=1e-5 * texel.max())


def _check_message(message: str, path: Path) -> None:
    assert "\n" not in message, f"more than one line: {message!r}"
    assert message.isprintable(), f"cannot be printed: {message!r}"
    assert path.name.partition("_")[0].removesuffix(path.suffix) in message, f"no file: {message!r}"
    assert len(message) - len(str(path)) < 600, f"too long: {message!r}"


def _check_writing(entry: Format, brdf: Brdf, again: Path) -> None:
    """What was read can be written where its format can, and comes back."""
    assert entry.save is not None
    entry.save(brdf, again)
    back = entry.load(again)
    assert isinstance(back, Brdf)
    assert back.isotropic == brdf.isotropic
    if not isinstance(brdf, ScatteredBrdf):  # whose angles are rounded to 7 decimals
        ours, theirs = brdf.eval(WI, WO), back.eval(WI, WO)
        np.testing.assert_allclose(theirs, ours, rtol=1e-4, atol=1e-6 * ours.max())


def _listing(folder: Path) -> list[tuple[str, int, int]]:
    found = [(p.name, p.stat().st_size, p.stat().st_mtime_ns) for p in folder.iterdir()]
    return sorted(found)
