"""NumPy archives of textures: they come back, in little memory; what is bad is named."""

from __future__ import annotations

import os
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.btf import Btf, TableBtf
from nacre.errors import FormatError
from nacre.io.npy import TEXT_LIMIT
from nacre.io.outputs import overwrite
from nacre.measured.textures import UTIA, archive
from tests.specimens.tables import npy_bytes
from tests.specimens.textures import archive_bytes, arrays
from tests.test_writing import full_disk
from tests.textures.support import assert_refused


def texture(dtype: str = "f2", name: str = "cloth") -> TableBtf:
    wi, wo = (w[::9] for w in UTIA.pairs())
    values = np.random.default_rng(0).random((4, 3, len(wi), 3)).astype(dtype)
    return TableBtf(values, wi, wo, name)


@pytest.mark.parametrize("dtype", ["f2", "f4"])
def test_a_table_comes_back_mapped_and_numpy_reads_it(tmp_path: Path, dtype: str) -> None:
    made, path = texture(dtype), tmp_path / "x.npz"
    nacre.save(made, path)
    back = nacre.load(path)
    assert isinstance(back, TableBtf)
    assert not back.values.flags.owndata
    assert back.values.ctypes.data % 64 == 0
    assert back.values.dtype == np.dtype(dtype)
    assert back.name == "cloth"
    np.testing.assert_array_equal(back.values, made.values)
    np.testing.assert_array_equal(back.wi, made.wi)
    np.testing.assert_array_equal(back.wo, made.wo)
    found = np.load(path)
    np.testing.assert_array_equal(found["values"], made.values)
    np.testing.assert_array_equal(found["wi"], made.wi)
    assert str(found["name"]) == "cloth"
    assert zipfile.ZipFile(path).testzip() is None
    nacre.save(back, tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == path.read_bytes()


def test_a_file_that_was_written_over_is_named_and_one_in_its_place_is_another(tmp_path: Path):
    path = tmp_path / "x.npz"
    nacre.save(texture(), path)
    back = nacre.load(path)
    before = back.texels([3])
    path.with_name("y").write_bytes(bytes(100))
    path.with_name("y").replace(path)
    np.testing.assert_array_equal(back.texels([3]), before)
    path.unlink()
    nacre.save(texture(), path)
    back = nacre.load(path)
    os.truncate(path, 5000)  # to look at the rest would end the process
    with pytest.raises(FormatError, match=r"x\.npz: has changed since it was read"):
        back.texels([3])


@pytest.mark.parametrize("write", [np.savez, np.savez_compressed])
@pytest.mark.parametrize("dtype", ["f2", "f4", ">f8"])
def test_what_numpy_writes_is_read(tmp_path: Path, write, dtype: str) -> None:
    contents = arrays(dtype)
    del contents["name"]
    write(tmp_path / "felt.npz", **contents)
    back = nacre.load(tmp_path / "felt.npz")
    assert back.name == "felt"
    expected = contents["values"].astype(np.float32)
    for chosen in (slice(1, 4), np.array([5, 2])):
        texels = back.texels(chosen)
        np.testing.assert_array_equal(texels, expected.reshape(6, 2, 3)[chosen])
        assert texels.flags.writeable
        assert texels.flags.aligned
    np.testing.assert_array_equal(back.images(np.array([1]))[0], expected[:, :, 1])


@pytest.mark.parametrize(
    ("dtype", "precision", "expected"),
    [("f4", "half", "f2"), ("f2", "single", "f4"), ("f8", None, "f4"), ("f8", "half", "f2")],
)
def test_the_precision_can_be_chosen(
    tmp_path: Path, dtype: str, precision: str | None, expected: str
) -> None:
    nacre.save(texture(dtype), tmp_path / "x.npz", precision=precision)
    back = nacre.load(tmp_path / "x.npz")
    assert back.values.dtype == np.dtype(expected)
    np.testing.assert_allclose(back.values, texture(dtype).values, rtol=5e-4, atol=1e-7)


@pytest.mark.parametrize("name", ["", "ткань 織物", "x" * 3000])
def test_names_come_back(tmp_path: Path, name: str) -> None:
    nacre.save(texture(name=name), tmp_path / "x.npz")
    assert nacre.load(tmp_path / "x.npz").name == (name[:TEXT_LIMIT] or "x")


class _Computed(Btf):
    """Values that lie nowhere."""

    def __init__(self):
        super().__init__(50, 40, *UTIA.pairs())

    def texels(self, chosen):
        count = len(np.arange(self.texel_count)[chosen])
        return np.full((count, self.pair_count, 3), 0.5, np.float32)

    def images(self, chosen):
        raise NotImplementedError


def test_writing_takes_a_block_of_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive, "_BLOCK", 1 << 20)
    done: list[int] = []
    tracemalloc.start()
    try:
        nacre.save(_Computed(), tmp_path / "x.npz", progress=lambda *a: done.append(a[1]))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    size = (tmp_path / "x.npz").stat().st_size
    assert size > 70 << 20
    assert peak < 6 << 20
    assert done[-1] == 2000
    assert (nacre.load(tmp_path / "x.npz").texels(np.array([1999])) == 0.5).all()


def test_a_full_disk_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    nacre.save(texture(), path)
    whole = path.read_bytes()
    for size in (0, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(b"old")
        with full_disk(size), overwrite():
            assert_refused(lambda: nacre.save(texture(), path), str(path), "cannot be written")
        assert [p.read_bytes() for p in tmp_path.iterdir()] == [b"old"]


def test_values_too_large_for_half_floats_are_refused(tmp_path: Path) -> None:
    made = texture("f4")
    made.values[2, 1, 5] = 1e5
    path = tmp_path / "x.npz"
    assert_refused(lambda: nacre.save(made, path, precision="half"), str(path), "float16")
    assert not list(tmp_path.iterdir())
    nacre.save(made, path)
    assert nacre.load(path).texels(slice(None)).max() == np.float32(1e5)


def changed(tmp_path: Path, **replaced: npt.NDArray | None) -> Path:
    """A file with other arrays in place of its own, or without them."""
    contents = {k: v for k, v in (arrays() | replaced).items() if v is not None}
    path = tmp_path / "bad.npz"
    path.write_bytes(archive_bytes({name: npy_bytes(array) for name, array in contents.items()}))
    return path


TILTED = [0.6, 0.0, 0.8]


@pytest.mark.parametrize(
    ("replaced", "words"),
    [
        ({"values": None}, "has no array 'values'"),
        ({"wi": None}, "has no array 'wi'"),
        ({"values": np.zeros((2, 3, 2, 4))}, "(2, 3, 2, 4), expected (height, width, n, 3)"),
        ({"values": np.zeros((2, 3, 6))}, "expected (height, width, n, 3)"),
        ({"values": np.zeros((2, 0, 2, 3))}, "expected (height, width, n, 3)"),
        ({"values": np.zeros((2, 3, 1, 3))}, "has n = 1; there are 2 wi, 2 wo"),
        ({"values": np.zeros((2, 3, 2, 3), "u1")}, "'values': is of type uint8, expected floats"),
        ({"wi": np.array([[0, 0, 1]] * 2)}, "'wi': is of type int64, expected floats"),
        ({"values": np.zeros((2, 3, 2, 3), np.longdouble)}, "expected floats of 16, 32 or"),
        ({"values": np.asfortranarray(np.zeros((2, 3, 2, 3)))}, "is in Fortran order"),
        ({"wi": np.array([TILTED])}, "there are 1 wi, 2 wo"),
        ({"wi": np.zeros((0, 3))}, "expected (n, 3), n from 1"),
        ({"wo": np.zeros((2, 2))}, "expected (n, 3)"),
        (
            {"wi": np.array([TILTED, [0.0, np.nan, 1.0]])},
            "'wi': 2 of 2, (0, nan, 1), is not finite",
        ),
        ({"wi": np.array([TILTED, [0.0, 0.6, -0.8]])}, "is not above the horizon"),
        ({"wo": np.array([[1.0, 0.0, 0.0], TILTED])}, "'wo': 1 of 2, (1, 0, 0), is not above"),
        ({"wo": np.array([TILTED, [0.0, 0.7, 0.8]])}, "is not of unit length"),
        ({"wo": np.array([TILTED, [0.0, 1e300, 0.8]])}, "is not finite"),
        ({"name": np.array(["a", "b"])}, "is not one text"),
        ({"name": np.array("x" * 2000)}, "is not one text"),
        ({"name": np.array([7, 7])}, "'name': is of type int64, expected text"),
    ],
)
def test_bad_arrays_are_refused(tmp_path: Path, replaced: dict, words: str) -> None:
    path = changed(tmp_path, **replaced)
    assert_refused(lambda: nacre.load(path), str(path), words)


def test_values_that_are_not_finite_are_refused_when_used(tmp_path: Path) -> None:
    values = arrays("f4")["values"]
    values[1, 2, 0, 1] = np.nan
    found = nacre.load(changed(tmp_path, values=values))
    assert np.isfinite(found.texels(slice(0, 5))).all()
    assert_refused(lambda: found.texels(slice(5, 6)), "bad.npz: values: some are not finite")
    assert_refused(lambda: found.images(np.array([0])), "bad.npz: values: some are not finite")
    chosen = np.array([5])
    assert np.isfinite(found.texels_at(chosen, np.array([1]))).all()
    assert_refused(lambda: found.texels_at(chosen, np.array([0])), "values: some are not finite")


def test_objects_are_not_unpickled(tmp_path: Path) -> None:
    path = tmp_path / "bad.npz"
    np.savez(path, values=np.array([{}], object), wi=np.eye(3)[2:], wo=np.eye(3)[2:])
    assert_refused(lambda: nacre.load(path), "array 'values'")


def test_archives_that_claim_much_are_refused_in_little_memory(tmp_path: Path) -> None:
    bomb, crowd, deflated = tmp_path / "bomb.npz", tmp_path / "crowd.npz", zipfile.ZIP_DEFLATED
    with zipfile.ZipFile(bomb, "w", deflated, compresslevel=1) as file:
        for name, array in arrays().items():
            file.writestr(f"{name}.npy", bytes(65 << 20) if name == "values" else npy_bytes(array))
    crowd.write_bytes(archive_bytes({f"{k:080}": b"" for k in range(9000)}))
    promise = changed(tmp_path)
    data = bytearray(promise.read_bytes())
    for signature, place in ((b"PK\1\2", 24), (b"PK\3\4", 22)):  # lengths of values.npy
        start = data.index(signature)
        data[start + place : start + place + 4] = b"\xff\xff\xff\x7f"
    promise.write_bytes(data)
    tracemalloc.start()
    try:
        assert_refused(lambda: archive.load(bomb), str(bomb), "is larger than any table")
        assert_refused(lambda: archive.load(crowd), str(crowd), "its list is longer")
        assert_refused(lambda: archive.load(promise), str(promise), "does not lie whole")
        assert tracemalloc.get_traced_memory()[1] < 16 << 20
    finally:
        tracemalloc.stop()
