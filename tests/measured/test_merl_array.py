"""Tables over Rusinkiewicz angles as NumPy arrays, whole and damaged."""

from __future__ import annotations

import io
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.measured import MerlBrdf, merl_array
from nacre.measured.merl_array import load_npy, load_npz, save_npz
from nacre.measured.merl_table import SCALES

from ..specimens.tables import npz_bytes as npz_packed
from .support import assert_refused, hemisphere, write

SMALL = (7, 6, 8)


def random_f_r(seed: int = 0) -> npt.NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    f_r = rng.random((*SMALL, 3))
    f_r[rng.random(SMALL) < 0.1] = -1.0
    return f_r


def npy_bytes(array: npt.NDArray[Any]) -> bytes:
    content = io.BytesIO()
    np.save(content, array)
    return content.getvalue()


def npz_bytes(**arrays: npt.NDArray[Any]) -> bytes:
    content = io.BytesIO()
    np.savez(content, **arrays)
    return content.getvalue()


def assert_same_table(brdf: nacre.Brdf, f_r: npt.NDArray[Any], rtol: float = 1e-6) -> None:
    assert isinstance(brdf, MerlBrdf)
    assert brdf.name == "table"
    np.testing.assert_allclose(np.moveaxis(brdf.stored, 0, -1) * SCALES, f_r, rtol=rtol)
    np.testing.assert_array_equal(brdf.mask, (f_r >= 0).all(axis=-1))


@pytest.mark.parametrize("dtype", ["<f2", "<f4", "<f8", ">f4"])
@pytest.mark.parametrize("first", [False, True])
@pytest.mark.parametrize("order", ["C", "F"])
def test_array_of_any_float_type_and_order(
    tmp_path: Path, dtype: str, first: bool, order: Any
) -> None:
    f_r = random_f_r()
    array = np.asarray(np.moveaxis(f_r, -1, 0) if first else f_r, dtype=dtype, order=order)
    rtol = 1e-3 if dtype == "<f2" else 1e-6
    assert_same_table(nacre.load(write(tmp_path / "table.npy", npy_bytes(array))), f_r, rtol)
    for name in ("f_r", "anything"):
        path = write(tmp_path / "table.npz", npz_bytes(**{name: array}))
        assert_same_table(nacre.load(path), f_r, rtol)


def test_f_r_is_chosen_among_arrays(tmp_path: Path) -> None:
    f_r = random_f_r()
    path = write(tmp_path / "table.npz", npz_bytes(other=np.zeros(3), f_r=f_r))
    assert_same_table(nacre.load(path), f_r)
    compressed = io.BytesIO()
    np.savez_compressed(compressed, f_r=f_r)
    assert_same_table(nacre.load(write(path, compressed.getvalue())), f_r)


def test_values_are_reflectance_without_scales(tmp_path: Path) -> None:
    path = write(tmp_path / "grey.npy", npy_bytes(np.full((*SMALL, 3), 0.25)))
    rng = np.random.default_rng(1)
    values = nacre.load(path).eval(hemisphere(rng, 100), hemisphere(rng, 100))
    np.testing.assert_allclose(values, 0.25, rtol=1e-5)


def test_saved_archive_comes_back_byte_for_byte(tmp_path: Path) -> None:
    brdf = MerlBrdf(np.moveaxis(random_f_r() * 700.0, -1, 0))
    first, second = tmp_path / "first.npz", tmp_path / "second.npz"
    save_npz(brdf, first)
    back = load_npz(first)
    np.testing.assert_array_equal(back.stored, brdf.stored)
    save_npz(back, second)
    assert first.read_bytes() == second.read_bytes()
    with np.load(first) as archive:
        assert archive["f_r"].shape == (*SMALL, 3)
        assert archive["f_r"].dtype == np.float64


def test_networks_and_tables_in_npy_files_are_told_apart() -> None:
    npy = merl_array.NPY
    assert npy.recognize is not None
    for shape, expected in (((90, 90, 180, 3), True), ((6, 21), False), ((21,), False)):
        for dtype in ("<f2", "<f8"):
            head = npy_bytes(np.zeros(shape, dtype))[:128]
            assert npy.recognize(head) == expected


@pytest.mark.parametrize("shape", [(90, 90, 180), (4, 4, 4, 4), (0, 4, 4, 3), (1025, 1, 1, 3), ()])
def test_array_of_another_shape_is_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    array = np.zeros(shape)
    assert_refused(load_npy, write(tmp_path / "a.npy", npy_bytes(array)), "expected")
    assert_refused(load_npz, write(tmp_path / "a.npz", npz_bytes(f_r=array)), "'f_r'", "expected")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_value_that_is_not_finite_is_refused(tmp_path: Path, value: float) -> None:
    f_r = random_f_r()
    f_r[1, 2, 3, 1] = value
    assert_refused(load_npy, write(tmp_path / "a.npy", npy_bytes(f_r)), "not finite")
    assert_refused(load_npz, write(tmp_path / "a.npz", npz_bytes(f_r=f_r)), "not finite")


def test_signalling_nan_is_refused_without_a_warning(tmp_path: Path) -> None:
    f_r = random_f_r().astype(np.float16)
    f_r.view(np.uint16)[1, 2, 3, 1] = 0x7C01
    assert_refused(load_npy, write(tmp_path / "a.npy", npy_bytes(f_r)), "not finite")


def test_other_types_are_refused(tmp_path: Path) -> None:
    for array in (np.zeros((*SMALL, 3), np.int32), np.zeros((*SMALL, 3), complex)):
        assert_refused(load_npy, write(tmp_path / "a.npy", npy_bytes(array)), "expected floats")
    pickled = io.BytesIO()
    np.save(pickled, np.array([{}] * 3, object), allow_pickle=True)
    assert_refused(load_npy, write(tmp_path / "a.npy", pickled.getvalue()), "expected floats")


def test_file_cut_short_or_too_long_is_refused(tmp_path: Path) -> None:
    for data, load in (
        (npy_bytes(random_f_r()), load_npy),
        (npz_bytes(f_r=random_f_r()), load_npz),
    ):
        path = tmp_path / "cut"
        for length in [*range(1, 160, 3), *range(160, len(data), 97), len(data) - 1]:
            assert_refused(load, write(path, data[:length]), "")
    assert_refused(load_npy, write(path, npy_bytes(random_f_r()) + b"\0"), "promises")
    assert_refused(load_npy, tmp_path / "absent.npy", "no such file")
    assert_refused(load_npz, write(path, b""), "is empty")


def test_archives_of_other_things_are_refused(tmp_path: Path) -> None:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("readme.txt", "nothing here")
    path = write(tmp_path / "a.npz", content.getvalue())
    assert_refused(load_npz, path, "0 arrays")
    assert_refused(nacre.load, path, "has no array 'values'")
    two = npz_bytes(a=np.zeros(3), b=np.zeros(3))
    assert_refused(load_npz, write(path, two), "2 arrays", "'f_r'")


def test_archives_that_unpack_to_more_than_they_say_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    content = npy_bytes(np.full((*SMALL, 3), 0.5))
    data = bytearray(npz_packed(content + bytes(1 << 26), method=zipfile.ZIP_DEFLATED))
    for place in (22, data.index(b"PK\1\2") + 24):
        data[place : place + 4] = len(content).to_bytes(4, "little")
    empty = npz_packed(bytes(1 << 27), method=zipfile.ZIP_DEFLATED)
    tracemalloc.start()
    try:
        assert_refused(load_npz, write(path, bytes(data)), str(path))
        assert_refused(load_npz, write(path, empty), "larger than any table")
        assert tracemalloc.get_traced_memory()[1] < 1 << 22
    finally:
        tracemalloc.stop()
    unusual = npz_packed(content, method=zipfile.ZIP_BZIP2)
    assert_refused(load_npz, write(path, unusual), "numpy.savez")
