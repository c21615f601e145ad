"""Spectra of large RGL files stay in the file: the same numbers, the same errors."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.measured import rgl, rgl_tables
from tests.measured.support import hemisphere, material, spectral, tensor_bytes, write

FIELDS = spectral(material([0.0]))
CONTENT = tensor_bytes(FIELDS)
WI, WO = hemisphere(np.random.default_rng(1), 99), hemisphere(np.random.default_rng(2), 99)


@pytest.fixture
def path(tmp_path, monkeypatch):
    """A spectral file, which counts as large from here on."""
    monkeypatch.setattr(rgl_tables, "_MAPPED", 1)
    return write(tmp_path / "a_spec.bsdf", CONTENT)


def spectra(brdf):
    return brdf.eval_spectral(WI, WO)


def test_mapped_tables_are_those_that_are_read(path, monkeypatch):
    mapped = rgl.load(path)
    monkeypatch.setattr(rgl_tables, "_MAPPED", 1 << 26)
    read = rgl.load(path)
    assert (mapped.tables.file is None, read.tables.file is None) == (False, True)
    np.testing.assert_array_equal(mapped.eval(WI, WO), read.eval(WI, WO), strict=True)
    np.testing.assert_array_equal(spectra(mapped), spectra(read), strict=True)
    assert mapped.nbytes == read.nbytes
    assert not mapped.tables.spectra.flags.writeable
    assert not mapped.tables.spectra.flags.owndata
    assert all(a.flags.owndata for a in (mapped.tables.ndf, mapped.tables.vndf))
    copy = pickle.loads(pickle.dumps(mapped.tables))
    assert copy.file is None
    np.testing.assert_array_equal(copy.spectra, read.tables.spectra)


def test_damaged_files_are_refused_as_those_that_are_read(path, monkeypatch):
    poisoned = np.frombuffer(CONTENT, np.uint8).copy()
    poisoned[-7:] = 255
    contents = [CONTENT[:n] for n in (0, 5, 13, 99, 300, len(CONTENT) // 2, len(CONTENT) - 1)]
    for content in (*contents, poisoned.tobytes(), b"x" * 5000):
        path.write_bytes(content)
        found = []
        for limit in (1, 1 << 26):
            monkeypatch.setattr(rgl_tables, "_MAPPED", limit)
            with pytest.raises(FormatError) as error:
                rgl.load(path)
            found.append(str(error.value))
        assert found[0] == found[1]


def test_a_file_that_takes_its_place_changes_nothing(path):
    brdf = rgl.load(path)
    before = spectra(brdf)
    write(path.with_name("b.bsdf"), tensor_bytes(material([0.0], 7))).replace(path)
    assert rgl.load(path).wavelengths is None
    np.testing.assert_array_equal(spectra(brdf), before)
    path.unlink()
    np.testing.assert_array_equal(spectra(brdf), before)


@pytest.mark.parametrize("content", [b"", CONTENT[:4096], CONTENT + b"x", CONTENT[::-1]])
def test_a_file_that_is_written_over_is_found_out(path, content):
    brdf = rgl.load(path)
    before = brdf.eval(WI, WO)
    path.write_bytes(content)
    os.utime(path, (1e9, 1e9))
    for look in (spectra, lambda brdf: rgl.save(brdf, Path(f"{path}.bsdf"))):
        with pytest.raises(FormatError, match=r"a_spec\.bsdf: has changed since it was read"):
            look(brdf)
    np.testing.assert_array_equal(brdf.eval(WI, WO), before)
    assert brdf.describe()
    assert not Path(f"{path}.bsdf").exists()


def test_files_are_closed_with_their_materials(path):
    if not Path("/proc/self/fd").is_dir():
        pytest.skip("no list of open files here")
    before = len(list(Path("/proc/self/fd").iterdir()))
    for _ in range(20):
        rgl.load(path)
    assert len(list(Path("/proc/self/fd").iterdir())) <= before + 2
