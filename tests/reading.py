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
from nacre.errors import FormatError, MissingExtraError, NacreError
from nacre.io.format import HEAD, Format
from nacre.measured import ScatteredBrdf
from nacre.measured.specular_nodes import Resolution
from nacre.measured.textures.ubo2014.reader import Ubo2014Btf
from tests.fuzz.readers import Reader
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
    if entry.recognize is not None:
        assert entry.recognize(data[:HEAD]) in (True, False)
    start = tracemalloc.get_traced_memory()[0]
    tracemalloc.reset_peak()
    try:
        loaded: Brdf | Btf | None = entry.load(path)
        if isinstance(loaded, Btf):
            check_texture(loaded)  # which may come upon damage only now
    except MissingExtraError:
        loaded = None
    except FormatError as error:
        loaded = None
        _check_message(str(error), path)
    if isinstance(loaded, Brdf):
        check_values(loaded)
    peak = tracemalloc.get_traced_memory()[1] - start
    whole = len(data) + sum(map(len, specimen.companions.values()))
    assert peak <= 8 * whole + specimen.memory, f"{peak} bytes of memory for {whole} of file"
    factored = isinstance(loaded, Ubo2014Btf)  # which is written with other factors
    if loaded is not None and entry.save is not None and not factored:
        _check_writing(entry, loaded, again)
    assert _listing(path.parent) == before, "reading changed the folder"
    return loaded is not None, peak


def check_use(reader: Reader, path: Path) -> tuple[bool, int]:
    """Read a file that holds no material and may be damaged; as :func:`check_reading`."""
    data = path.read_bytes()
    before = _listing(path.parent)
    start = tracemalloc.get_traced_memory()[0]
    tracemalloc.reset_peak()
    try:
        reader.read(path)
        loaded = True
    except NacreError as error:
        loaded = False
        _check_line(str(error), path, 2000)
    peak = tracemalloc.get_traced_memory()[1] - start
    whole = len(data) + sum(map(len, reader.specimen.companions.values()))
    assert peak <= 8 * whole + reader.specimen.memory, f"{peak} bytes of memory for {whole} of file"
    assert reader.writes or _listing(path.parent) == before, "reading changed the folder"
    return loaded, peak


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


def _check_line(message: str, path: Path, most: int) -> None:
    assert "\n" not in message, f"more than one line: {message!r}"
    assert message.isprintable(), f"cannot be printed: {message!r}"
    assert len(message) - len(str(path)) < most, f"too long: {message!r}"


def _check_message(message: str, path: Path) -> None:
    _check_line(message, path, 600)
    assert path.name.partition("_")[0].removesuffix(path.suffix) in message, f"no file: {message!r}"


def check_texture(btf: Btf) -> None:
    """Values are finite, the same by texel and by pair, at directions above the horizon."""
    json.dumps(btf.describe(), ensure_ascii=False).encode()
    assert isinstance(btf.name, str)
    for w in (btf.wi, btf.wo):
        assert w.shape == (btf.pair_count, 3)
        assert w.dtype == np.float32
        assert (w[:, 2] > 0.0).all()
        np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1.0, atol=2e-3)
    for block in btf.blocks(1 << 24):
        texels = btf.texels(block)
        assert texels.shape == (block.stop - block.start, btf.pair_count, 3)
        assert texels.dtype == np.float32
        assert np.isfinite(texels).all()
    last = btf.images(np.array([btf.pair_count - 1]))
    assert last.shape == (1, btf.height, btf.width, 3)
    # Products of matrices of other shapes have other last bits.
    largest = max(1.0, float(np.abs(texels[-1]).max()))
    np.testing.assert_allclose(last[0, -1, -1], texels[-1, -1], rtol=1e-4, atol=1e-5 * largest)


def _check_writing(entry: Format, loaded: Brdf | Btf, again: Path) -> None:
    """What was read can be written where its format can, and comes back."""
    assert entry.save is not None
    if entry.model and not str(getattr(loaded, "model", "")).startswith(entry.model):
        return  # a model is fitted to it first
    coarse = {"resolution": Resolution(2, 4, 3)} if entry.resolution is Resolution else {}
    entry.save(loaded, again, **coarse)
    back = entry.load(again)
    if isinstance(loaded, Btf):
        assert isinstance(back, Btf)
        np.testing.assert_array_equal(back.texels(slice(0, 9)), loaded.texels(slice(0, 9)))
        return
    brdf = loaded
    assert isinstance(back, Brdf)
    assert back.isotropic == brdf.isotropic
    if not isinstance(brdf, ScatteredBrdf):  # whose angles are rounded to 7 decimals
        ours, theirs = brdf.eval(WI, WO), back.eval(WI, WO)
        np.testing.assert_allclose(theirs, ours, rtol=1e-4, atol=1e-6 * ours.max())


def _listing(folder: Path) -> list[tuple[str, int, int]]:
    found = [(p.name, p.stat().st_size, p.stat().st_mtime_ns) for p in folder.iterdir()]
    return sorted(found)
