"""Packed files are read as what is in them."""

from __future__ import annotations

import gzip
import lzma
import threading
import zipfile
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.formats import load_btf
from nacre.io import unpacked as folders
from nacre.io.names import guessed_ending, stem
from nacre.io.packed import inner_names, unpacked
from tests.packing import PACKED, zipped
from tests.reading import WI, WO
from tests.specimens import SPECIMENS

KINDS = (
    "RGL",
    "MERL",
    "UTIA",
    "comma-separated samples",
    "analytic",
    "NBRDF network (Keras)",
    "nacre neural material",
    "MERL array (.npz)",
    "NumPy archive of a BTF",
    "UBO2014",
    "nacre encoded texture",
)
RGL = SPECIMENS["RGL"].files()[0]


def bits(path: Path) -> tuple[object, bytes]:
    found = nacre.load(path)
    if isinstance(found, Btf):
        return found.describe(), found.texels(slice(0, found.texel_count)).tobytes()
    return found.describe(), found.eval(WI, WO).tobytes()


@pytest.mark.parametrize("ending", [*PACKED, ".zip"])
@pytest.mark.parametrize("kind", KINDS)
def test_they_have_the_same_bits(tmp_path: Path, kind: str, ending: str) -> None:
    specimen = SPECIMENS[kind]
    if specimen.module:
        pytest.importorskip(specimen.module, reason=f"needs {specimen.module}")
    content = specimen.files()[0]
    plain, packed = tmp_path / specimen.name, tmp_path / f"{specimen.name}{ending}"
    plain.write_bytes(content)
    pack = PACKED.get(ending, lambda content: zipped({f"data/{specimen.name}": content}))
    packed.write_bytes(pack(content))
    assert bits(packed) == bits(plain)
    found = nacre.load(packed)
    assert found.name == nacre.load(plain).name
    assert (found.source or {})["file"] == packed.name
    assert (found.source or {})["sha256"] == nacre.io.files.digest(packed)


def test_the_content_decides_under_another_name(tmp_path: Path) -> None:
    (tmp_path / "a.bsdf").write_bytes(gzip.compress(RGL))
    (tmp_path / "b").write_bytes(lzma.compress(RGL))
    assert bits(tmp_path / "a.bsdf")[1] == bits(tmp_path / "b")[1]


def test_several_streams_and_padding_are_one_file(tmp_path: Path) -> None:
    for ending, pack in PACKED.items():
        path = tmp_path / f"a.bsdf{ending}"
        path.write_bytes(pack(RGL[:300]) + pack(RGL[300:]) + bytes(512))
        assert bits(path)[1]


def test_the_one_material_of_an_archive_is_read(tmp_path: Path) -> None:
    beside = {"README.txt": b"a", "__MACOSX/._a.bsdf": b"\0\5\x16\7", "x/.DS_Store": b"a"}
    picture = {"preview.png": b"\x89PNG\r\n\x1a\n" + bytes(30), "table.csv": b"a,b\n1,2\n"}
    path = tmp_path / "a.zip"
    path.write_bytes(zipped({**beside, **picture, "x/a.bsdf": RGL}))
    assert bits(path)[1]
    assert nacre.load(path).source["file"] == "a.zip"


def test_names_in_archives_lead_nowhere(tmp_path: Path) -> None:
    for name in ("../../out.bsdf", "/out.bsdf", "a\\..\\..\\out.bsdf", "x" * 300 + ".bsdf"):
        (tmp_path / "a.zip").write_bytes(zipped({name: RGL}))
        assert bits(tmp_path / "a.zip")[1]
        assert list(tmp_path.iterdir()) == [tmp_path / "a.zip"]


def test_links_in_archives_are_not_followed(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        link = zipfile.ZipInfo("a.bsdf")
        link.external_attr = 0o120777 << 16
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(FormatError, match="is an archive of no files"):
        nacre.load(tmp_path / "a.zip")


def test_what_unpacks_to_too_much_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nacre.io.unpacking._WHOLE", len(RGL) - 1)
    monkeypatch.setattr("nacre.io.unpacking._RATIO", 0)
    for ending, pack in {**PACKED, ".zip": lambda content: zipped({"a.bsdf": content})}.items():
        path = tmp_path / f"a.bsdf{ending}"
        path.write_bytes(pack(RGL))
        with pytest.raises(
            FormatError, match=f"unpacks to more than {len(RGL) - 1:,} bytes; if you trust it"
        ):
            nacre.load(path)


def test_unpacked_folders_go(tmp_path: Path) -> None:
    seen: list[Path] = []

    def wanted(path: Path) -> bool:
        raise AssertionError

    for name in "ab":
        (tmp_path / f"{name}.bsdf.gz").write_bytes(gzip.compress(RGL))
    for name in "aabba":
        with unpacked(tmp_path / f"{name}.bsdf.gz", tuple, wanted) as file:
            assert file.read_bytes() == RGL
            seen.append(file)
    assert seen[0] == seen[1] != seen[2] == seen[3]
    assert not seen[0].parent.exists()
    (tmp_path / "a.bsdf.gz").write_bytes(gzip.compress(RGL + b"more"))
    with unpacked(tmp_path / "a.bsdf.gz", tuple, wanted) as file:
        assert file.read_bytes() == RGL + b"more"
    folders._clear(0)
    assert not any(path.parent.exists() for path in [*seen, file])


def test_a_packed_texture_outlives_its_folder(tmp_path: Path) -> None:
    content = SPECIMENS["NumPy archive of a BTF"].files()[0]
    (tmp_path / "cloth.npz").write_bytes(content)
    (tmp_path / "cloth.npz.gz").write_bytes(gzip.compress(content))
    texture = load_btf(tmp_path / "cloth.npz.gz")
    folders._clear(0)
    whole = slice(0, texture.texel_count)
    expected = load_btf(tmp_path / "cloth.npz").texels(whole)
    np.testing.assert_array_equal(texture.texels(whole), expected)


def test_threads_share_what_is_unpacked(tmp_path: Path) -> None:
    for k in range(3):
        (tmp_path / f"{k}.bsdf.gz").write_bytes(gzip.compress(RGL))
    found: list[object] = []

    def read(k: int) -> None:
        found.extend(bits(tmp_path / f"{k % 3}.bsdf.gz")[1] for _ in range(5))

    threads = [threading.Thread(target=read, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 30
    assert len(set(found)) == 1


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("paint.bsdf", "paint"),
        ("paint.bsdf.gz", "paint"),
        ("paint.BSDF.GZ", "paint"),
        ("gold.zip", "gold"),
        ("gold.bsdf.zip", "gold"),
        ("net.h5.xz", "net"),
        ("paint.v2.zip", "paint.v2"),
        ("paint.0.5mm.zip", "paint.0.5mm"),
        ("paint.v2.bsdf.bz2", "paint.v2"),
    ],
)
def test_stems(name: str, expected: str) -> None:
    assert stem(name) == expected


def test_inner_names(tmp_path: Path) -> None:
    (tmp_path / "a.zip").write_bytes(zipped({"x/b.bsdf": b"", "c.txt": b"", ".d": b""}))
    assert inner_names(tmp_path / "a.zip") == ["b.bsdf", "c.txt"]
    (tmp_path / "d.csv.zip").write_bytes(b"PK")
    assert inner_names(tmp_path / "d.csv.zip") == ["d.csv"]
    assert inner_names("a.bsdf.gz") == ["a.bsdf"]
    assert inner_names("a.bsdf") == ["a.bsdf"]


@pytest.mark.parametrize(
    ("head", "ending"), [(b' {"a"', ".json"), (b"[1", ".json"), (b"a,b\n", ".csv"), (b"\0,", "")]
)
def test_endings_are_guessed(head: bytes, ending: str) -> None:
    assert guessed_ending(head) == ending


def test_gzip_keeps_the_ending(tmp_path: Path) -> None:
    content = SPECIMENS["UTIA"].files()[0]
    with gzip.open(tmp_path / "table.bin.gz", "wb", 1) as file:
        file.write(content)
    (tmp_path / "table.bin.gz").rename(tmp_path / "stdin")
    assert nacre.load(tmp_path / "stdin").name == "stdin"
