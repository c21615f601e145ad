"""Files that are no data, though their names say so: each is named, with what to do about it."""

from __future__ import annotations

import bz2
import gzip
import lzma
import pickle
import re
import zipfile
from pathlib import Path
from typing import Any

import pytest

import nacre
from nacre.errors import FormatError
from nacre.formats import load_brdf
from nacre.workflows.sources import find_sources
from nacre.workflows.viewing import find_materials, read_materials
from tests.cli.support import assert_refused, run
from tests.cli.test_streams import piped
from tests.packing import PACKED, tarred, zipped
from tests.specimens import SPECIMENS

RGL = SPECIMENS["RGL"].files()[0]
PAGE = b"<!DOCTYPE html>\n<html><head><title>Log in</title></head></html>\n"
LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n"
LOCKED = bytearray(zipped({"paint.bsdf": RGL}))
for start, place in ((b"PK\3\4", 6), (b"PK\1\2", 8)):
    LOCKED[LOCKED.index(start) + place] |= 1

DISGUISES: dict[str, tuple[bytes, str]] = {
    "page.bsdf": (PAGE, "is a web page, not data: open it in a browser to see"),
    "wall.csv": (b"\n<!-- theta_i --><!-- --> <HTML lang=en><p>cookies", "is a web page"),
    "bom.xml": (b"\xef\xbb\xbf<?xml version='1.0'?>\n<!DOCTYPE html PUBLIC>", "is a web page"),
    "wide.csv": ("\ufeff<html>".encode("utf-16"), "is a web page"),
    "bucket.bsdf": (
        b'<?xml version="1.0"?>\n<Error><Code>AccessDenied</Code></Error>',
        r"is a server's error message \(XML\)",
    ),
    "answer.json": (b'{"message": "Not Found", "status": "404"}', r"is a server's answer \(JSON\)"),
    "raw.binary": (b"404: Not Found", "is a server's error message, not data"),
    "lfs.bsdf": (LFS, "is a Git LFS pointer, not the data; run 'git lfs pull' in its folder"),
    "lfs.npz": (LFS, "is a Git LFS pointer"),
    "annex.bsdf": (b"/annex/objects/MD5E-s9--abc.bsdf\n", "is a git-annex pointer: .* annex get"),
    "link.csv": (b"[InternetShortcut]\r\nURL=http://a", "is a link to a web page"),
    "._mac.bsdf": (b"\0\5\x16\7\0\2\0\0", "is what macOS keeps beside a file"),
    "empty.bsdf": (b"", "is empty; copy or download it again"),
    "zeros.binary": (bytes(9000), "holds only zeros"),
    "zeros.bin": (bytes(9000), "holds only zeros"),
    "paint.bsdf.crdownload": (RGL, "is an unfinished download; let it finish"),
    "paint.csv.part": (b"theta_i,phi_i\n", "is an unfinished download"),
    "short.bsdf": (RGL[:500], "cut short or damaged; copy or download it again"),
    "short.bsdf.gz": (gzip.compress(RGL)[:200], "is an unfinished .gz file, cut short; copy or"),
    "short.bsdf.bz2": (bz2.compress(RGL)[:200], "is an unfinished .bz2 file"),
    "short.bsdf.xz": (lzma.compress(RGL)[:200], "is an unfinished .xz file"),
    "short.zip": (zipped({"paint.bsdf": RGL})[:200], "is a damaged or unfinished .zip file"),
    "bad.bsdf.gz": (b"\x1f\x8b\x08\0" + bytes(60), "is a damaged or unfinished .gz file"),
    "bad.bsdf.bz2": (b"BZh9" + bytes(60), "is a damaged or unfinished .bz2 file"),
    "a.tar": (tarred("paint.bsdf", RGL, "w"), "is a .tar archive; .*: tar xf a.tar$"),
    "a b.tar.gz": (tarred("paint.bsdf", RGL, "w:gz"), "is a .tar archive; .*: tar xf 'a b.tar.gz'"),
    "a.tgz": (tarred("paint.bsdf", RGL, "w:gz"), "is a .tar archive"),
    "a.tar.xz": (tarred("paint.bsdf", RGL, "w:xz"), "is a .tar archive"),
    "a.7z": (b"7z\xbc\xaf\x27\x1c" + bytes(30), r"is a 7-Zip archive .*: 7z x a\.7z$"),
    "a.rar": (b"Rar!\x1a\x07\1\0" + bytes(30), "is a RAR archive"),
    "paint.bsdf.zst": (
        b"\x28\xb5\x2f\xfd\4",
        "is packed with Zstandard .*: zstd -d paint",
    ),
    "paint.bsdf.Z": (b"\x1f\x9d\x90abc", "is packed with compress"),
    "twice.bsdf.gz": (gzip.compress(gzip.compress(RGL)), "is packed twice"),
    "zip.bsdf.gz": (gzip.compress(zipped({"a.bsdf": RGL})), "is packed twice"),
    "two.zip": (
        zipped({"a.bsdf": RGL, "b.bsdf": RGL}),
        r"is an archive of 2 files \(a.bsdf, b.bsdf\); unpack it, .*: unzip two.zip$",
    ),
    "none.zip": (
        zipped({f"{k}.txt": b"a" for k in range(9)}),
        r"9 files \(0.txt, 1.txt, 2.txt, 3.txt, 4.txt, \.\.\.\), none of them a material",
    ),
    "photographs.zip": (
        zipped({"directions.csv": b"file,theta_l,phi_l,theta_v,phi_v\na.png,0,0,0,0\n", "a": b"a"}),
        "none of them a material by itself; unpack it",
    ),
    "nothing.zip": (zipped({}), "is an empty .zip archive"),
    "locked.zip": (bytes(LOCKED), "needs a password; unpack it"),
    "lzma.zip": (zipped({"a.bsdf": RGL}, zipfile.ZIP_LZMA), "is packed in an unusual way"),
    "page.zip": (zipped({"paint.bsdf": PAGE}), "is a web page"),
    "page.bsdf.gz": (gzip.compress(PAGE), "is a web page"),
    "paper.pdf": (b"%PDF-1.7\n", "is a PDF document"),
    "photo.jpg": (b"\xff\xd8\xff\xe0" + bytes(20), r"is a picture \(JPEG\)"),
    "scan.tif": (b"II*\0" + bytes(20), r"is a picture \(TIFF\)"),
    "photo.webp": (b"RIFF\4\0\0\0WEBPVP8 ", r"is a picture \(WebP\)"),
    "table.xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(99), "is a Word or Excel document"),
    "table.xlsx": (
        zipped({"[Content_Types].xml": b"a", "xl/workbook.xml": b"a"}),
        "is not a whole spreadsheet",
    ),
    "text.docx": (zipped({"[Content_Types].xml": b"a", "word/document.xml": b"a"}), "is a Word"),
    "data.pkl": (pickle.dumps({"f_r": [1.0]}), "is a Python pickle, which would run code"),
    "net.pt": (zipped({"archive/data.pkl": b"a", "archive/version": b"3"}), "is a PyTorch file"),
    "data.mat": (b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(128), "is a MATLAB file"),
    "new.mat": (b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(128), "is a MATLAB file"),
    "scene.usdz": (zipped({"a.usdc": b"PXR-USDC"}), "is a USD package"),
}
"""Content and words of the refusal, by name."""


@pytest.fixture(params=DISGUISES)
def disguised(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[Path, str]:
    monkeypatch.chdir(tmp_path)
    content, words = DISGUISES[request.param]
    Path(request.param).write_bytes(content)
    return Path(request.param), words


def test_python_names_them(disguised: tuple[Path, str]) -> None:
    path, words = disguised
    for read in (nacre.load, load_brdf):
        with pytest.raises(FormatError, match=words) as caught:
            read(path)
        assert str(caught.value).startswith(f"{path}: ")
        assert "nacre-" not in str(caught.value)  # a temporary folder


@pytest.mark.parametrize("command", ["info", "fit"])
def test_commands_name_them(disguised: tuple[Path, str], command: str, capsys: Any) -> None:
    path, words = disguised
    assert run(command, path) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"nacre: {path}: ")
    assert error.count("\n") == 1
    with pytest.raises(FormatError, match=words):
        nacre.load(path)
    assert sorted(Path().iterdir()) == [path]


def test_standard_input_is_named_too(disguised: tuple[Path, str]) -> None:
    path, words = disguised
    if "unfinished download" in words:
        pytest.skip("only the name tells")
    code, _, error = piped(path.read_bytes(), "info", "-")
    assert code == 2
    assert error.startswith("nacre: stdin")
    assert error.count("\n") == 1
    assert re.search(words.partition(": ")[0], error)


def test_a_link_of_git_annex_without_its_content(tmp_path: Path) -> None:
    path = tmp_path / "paint.bsdf"
    path.symlink_to(".git/annex/objects/Xw/1k/MD5E-s9--abc.bsdf")
    with pytest.raises(FormatError, match=r"is a git-annex link: .* run 'git annex get' on it"):
        nacre.load(path)


def test_a_black_table_of_zeros_is_a_material(tmp_path: Path) -> None:
    (tmp_path / "black.bin").write_bytes(bytes(288 * 288 * 3 * 8))
    assert not load_brdf(tmp_path / "black.bin").eval([0, 0.6, 0.8], [0, 0, 1]).any()


def test_a_table_may_begin_as_another_kind_of_file_does(tmp_path: Path) -> None:
    """Its first bytes are those of a value, and may be any."""
    for start in (b"\x1f\x8b\x08\x08", b"BZh9", b"\x80\4\x95"):
        content = bytearray(288 * 288 * 3 * 8)
        content[: len(start)] = start
        (tmp_path / "odd.bin").write_bytes(content)
        assert nacre.load(tmp_path / "odd.bin").name == "odd"


def test_a_folder_counts_them_by_what_they_should_be(tmp_path: Path) -> None:
    contents = {
        "gold.bsdf": RGL,
        "gray.bsdf.gz": PACKED[".gz"](RGL),
        "red.zip": zipped({"red.bsdf": RGL, "notes.txt": b"red"}),
        "samples.csv.xz": PACKED[".xz"](SPECIMENS["comma-separated samples"].files()[0]),
        "pointer.csv": LFS,
        "page.bsdf": PAGE,
        "cut.bsdf.gz": PACKED[".gz"](RGL)[:99],
    }
    others = {
        "prices.csv": b"a,b\n1,2\n",
        "prices.csv.gz": gzip.compress(b"a,b\n1,2\n"),
        "notes.txt.gz": gzip.compress(b"notes"),
        "pictures.zip": zipped({"a.jpg": b"\xff\xd8\xff"}),
        "page.html": PAGE,
    }
    for name, content in {**contents, **others}.items():
        (tmp_path / name).write_bytes(content)
    left_out: list[Path] = []
    found = find_sources([tmp_path], tmp_path / "fits", left_out.append)
    assert {source.path.name for source in found} == {*contents}
    assert [path.name for path in left_out] == ["prices.csv", "prices.csv.gz"]
    shown = find_materials([tmp_path])
    assert {source.path.name for source in shown} == {*contents}
    refused: list[str] = []
    entries = list(read_materials(shown, lambda path, error: refused.append(path.name)))
    assert {entry.facts["File"] for entry in entries} == {"gold", "gray", "red", "samples"}
    assert refused == ["cut.bsdf.gz", "page.bsdf", "pointer.csv"]


@pytest.mark.slow
def test_outputs_are_named_after_what_is_packed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("library").mkdir()
    for place in (Path(), Path("library")):
        (place / "paint.bsdf.gz").write_bytes(gzip.compress(RGL))
        (place / "gold.zip").write_bytes(zipped({"x.bsdf": RGL}))
    quick = ("--epochs", 1, "--samples", 2000)
    assert run("fit", "paint.bsdf.gz", "gold.zip", *quick) == 0
    assert run("fit", "library", "-o", "fits/", *quick) == 0
    for folder in (Path(), Path("fits")):
        assert (folder / "paint.safetensors").exists()
        assert (folder / "gold.safetensors").exists()
    assert (nacre.load("paint.safetensors").source or {})["file"] == "paint.safetensors"
    capsys.readouterr()
    assert run("fit", "library", "-o", "fits/", *quick, quiet=False) == 0
    assert "2 unchanged" in capsys.readouterr().out
    Path("gold.safetensors").write_bytes(b"mine")
    assert_refused(capsys, "gold.safetensors: exists", "fit", "gold.zip")
