"""The registry: reading by content, writing by name, clear refusals."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre import formats
from nacre.btf import TableBtf
from nacre.errors import FormatError, NacreError
from nacre.io.files import digest
from nacre.io.format import HEAD, Format
from nacre.measured import utia
from nacre.neural import Layer, NeuralBrdf
from nacre.signatures import SIGNATURES
from nacre.textures.codecs.codec_file import PUBLISHED as CODEC
from tests.specimens import SPECIMENS
from tests.textures.support import assert_refused


def gray() -> NeuralBrdf:
    return NeuralBrdf([Layer(np.zeros((6, 3), np.float32), np.full(3, 0.2, np.float32))])


EXACT = (".safetensors", ".h5", ".binary", ".bin", ".npz", ".exr")
BETWEEN_NODES = (".bsdf", ".xml", ".zemax.bsdf", ".brdf", ".xompt")
"""Whose nodes are not where they are asked for here, or are written in few digits."""


@pytest.mark.parametrize("ending", [*EXACT, *BETWEEN_NODES])
def test_every_writable_format_round_trips_through_the_registry(tmp_path, ending):
    path = tmp_path / f"gray{ending}"
    nacre.save(gray(), path)
    back = nacre.load(path)
    tolerance = 1e-5 if ending in EXACT else 1e-3
    wi = np.array([[0.1, 0.2, 0.9], [0.5, 0.0, 0.8]])
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    np.testing.assert_allclose(back.eval(wi, wi[::-1]), np.exp(0.2) - 1, rtol=tolerance)
    assert back.name == "gray"
    assert back.source["file"] == path.name
    assert len(back.source["sha256"]) == 64


def test_content_decides_over_a_wrong_ending(tmp_path):
    nacre.save(gray(), tmp_path / "gray.binary")
    (tmp_path / "gray.binary").rename(tmp_path / "gray.bsdf")
    assert type(nacre.load(tmp_path / "gray.bsdf")).__name__ == "MerlBrdf"


RECOGNIZED = [e.name for e in formats.formats() if e.recognize and e.name in SPECIMENS]


@pytest.mark.parametrize("name", [n for n in RECOGNIZED if "(NumPy)" not in n])
def test_content_decides_where_the_ending_says_nothing(tmp_path, name):
    """But for networks in `.npy` sets, whose names say what they hold."""
    specimen = SPECIMENS[name]
    for companion, content in specimen.companions.items():
        (tmp_path / companion).write_bytes(content)
    for number, content in enumerate(specimen.files()):
        own, other = tmp_path / f"{number}-{specimen.name}", tmp_path / f"{number}.txt"
        own.write_bytes(content)
        other.write_bytes(content)
        read = nacre.load(own)
        assert nacre.load(other).describe() | {"name": read.name} == read.describe()


@pytest.mark.parametrize(
    "ending", [e for entry in formats.formats("brdf") for e in entry.extensions]
)
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"\x00", "holds only zeros"),
        (
            b"hello, this is a text file and no material at all",
            "no known format|something else|not whole XML",
        ),
        (None, "no such file"),
    ],
)
def test_files_of_no_format_are_refused_in_one_line(tmp_path, ending, content, words):
    path = tmp_path / f"x{ending}"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FormatError, match=words) as caught:
        nacre.load(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_directory_is_refused(tmp_path):
    with pytest.raises(FormatError, match="is a directory"):
        nacre.load(tmp_path)


@pytest.mark.parametrize("name", ["x", "x.txt", "x.npy", "x.bsdfs"])
def test_what_cannot_be_written_is_refused_with_the_choices(tmp_path, name):
    with pytest.raises(FormatError, match=r"known: \.safetensors, .*\.bsdf, \.binary"):
        nacre.save(gray(), tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "resolution", "words"),
    [
        ("x.binary", (90, 90), "expected theta_h,theta_d,phi_d, got 90,90"),
        (
            "x.binary",
            (90, 90, 0),
            r"resolution 90,90,0 \(theta_h,theta_d,phi_d\): numbers of nodes",
        ),
        ("x.bsdf", (1, 2, 3), "expected phi_i,theta_i,square,azimuths,polars, got 1,2,3"),
        ("x.npz", (1, 2, 3, 4), "expected theta_h"),
        ("x.bin", (6, 48), "that of UTIA files is fixed"),
        ("x.h5", (21, 21), "is fixed"),
    ],
)
def test_a_resolution_that_a_format_cannot_have_is_refused(tmp_path, name, resolution, words):
    with pytest.raises(FormatError, match=words) as caught:
        formats.writer(tmp_path / name, resolution)
    assert name in str(caught.value)


def test_what_a_format_cannot_hold_is_known_before_the_work(tmp_path):
    isotropic, anisotropic = gray(), utia.tabulate(gray())
    for name in ("x.binary", "x.npz", "x.h5"):
        with pytest.raises(FormatError, match="hold isotropic reflectance only"):
            formats.check_target(tmp_path / name, anisotropic)
        formats.check_target(tmp_path / name, isotropic)
    formats.check_target(tmp_path / "x.bsdf", anisotropic)


def test_a_new_format_is_asked_first(tmp_path, monkeypatch):
    monkeypatch.setattr(formats.FORMATS, "_members", dict(formats.FORMATS))
    (tmp_path / "x.mine").write_bytes(b"# MINE")
    mine = Format("mine", (".mine",), lambda h: h == b"# MINE", lambda path: gray())
    formats.FORMATS.register("mine", mine)
    assert nacre.load(tmp_path / "x.mine").name == "x"
    assert next(iter(formats.formats())) is mine
    with pytest.raises(NacreError, match="there is a format 'mine' already"):
        formats.FORMATS.register("mine", mine)
    with pytest.raises(NacreError, match=r"is not a nacre\.io\.format\.Format"):
        formats.FORMATS.register("other", gray)


@pytest.mark.parametrize("name", list(SIGNATURES))
def test_a_signature_says_what_the_entry_says(name):
    signature, entry = SIGNATURES[name], formats.FORMATS[name]
    assert entry.name == name
    said = signature.extensions, signature.kind, signature.measured
    assert said == (entry.extensions, entry.kind, entry.measured)
    assert signature.writes == (entry.save is not None)
    assert signature.folders == (entry.claims_folder is not None)
    assert (signature.pattern is None) == (entry.recognize is None)


HEADS = [(name, content[:HEAD]) for name in SPECIMENS for content in SPECIMENS[name].files()]
ODD = (b"", b"\0" * HEAD, b"# remark\n", b"\xff\xfet\0h\0e\0t\0a\0_\0i\0", b"FILE\tX", b"{}")


def test_a_signature_leaves_out_nothing_that_the_entry_recognizes():
    entries = [entry for entry in formats.formats() if entry.recognize is not None]
    others = [change(head) for _, head in HEADS for change in (bytes.upper, bytes.lower)]
    for head in [*(head for _, head in HEADS), *others, *ODD]:
        for entry in entries:
            if entry.recognize(head):
                assert SIGNATURES[entry.name].allows(head), (entry.name, head[:80])


SHARED = {"comma-separated samples", "Cornell scan", "NumPy archive of a BTF", "MERL array (.npz)"}
SHARED |= {"MERL array (.npy)", "NBRDF network (NumPy)", "nacre neural material"}
SHARED |= {"nacre encoded texture", "RGL", "LightTools BSDF"}


@pytest.mark.parametrize("name", [name for name in SPECIMENS if formats.FORMATS[name].extensions])
def test_only_the_format_of_a_file_is_imported(tmp_path, monkeypatch, name):
    """But for formats that begin alike."""
    path = tmp_path / SPECIMENS[name].name
    path.write_bytes(next(iter(SPECIMENS[name].files())))
    monkeypatch.setattr(formats.FORMATS, "_members", {})
    formats.identify(path)
    assert set(formats.FORMATS._members) - SHARED <= {name}


def test_a_process_that_loads_a_table_imports_no_other_format(tmp_path):
    path = tmp_path / "x.bsdf"
    path.write_bytes(next(iter(SPECIMENS["RGL"].files())))
    code = f"import sys, nacre; nacre.load({str(path)!r}); print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(ran.stdout.split())
    places = {signature.place.partition(":")[0] for signature in SIGNATURES.values()}
    assert loaded & places == {"nacre.measured.rgl"}
    assert not loaded & {"numba", "scipy", "rich", "click"}


def test_every_format_is_listed_under_its_name():
    assert [entry.name for entry in formats.formats()] == list(formats.FORMATS)
    for kind in ("brdf", "btf"):
        assert {entry.kind for entry in formats.formats(kind)} == {kind}


# Textures


@pytest.fixture
def archive(tmp_path):
    up = np.array([[0.0, 0.0, 1.0]], np.float32)
    nacre.save(TableBtf(np.ones((2, 3, 1, 3), np.float16), up, up), tmp_path / "x.npz")
    return tmp_path / "x.npz"


def test_a_texture_is_loaded_as_a_material_is(archive):
    other = archive.rename(archive.with_suffix(".dat"))
    assert formats.identify(other).name == "NumPy archive of a BTF"
    found = nacre.load(other)
    assert isinstance(found, nacre.Btf)
    assert found.source == {"file": "x.dat", "sha256": digest(other)}
    assert formats.load_btf(other).pair_count == 1


def test_a_texture_is_refused_where_one_material_is_needed(archive):
    assert formats.is_btf(archive)
    assert_refused(lambda: formats.load_brdf(archive), str(archive), "nacre btf average")
    folder = archive.parent
    assert not formats.is_btf(folder)
    (folder / "tv000_pv000").mkdir()
    assert formats.is_btf(folder)
    assert_refused(lambda: formats.load_brdf(folder), str(folder), "nacre btf average")
    assert not formats.is_btf(folder / "absent")


def test_a_material_is_refused_where_a_texture_is_needed(tmp_path):
    for name, specimen in SPECIMENS.items():
        if formats.FORMATS[name].kind == "brdf":
            path = tmp_path / f"of-{specimen.name}"
            path.write_bytes(specimen.files()[0])
            assert not formats.is_btf(path)
            assert_refused(lambda path=path: formats.load_btf(path), str(path), "nacre btf tile")


def test_the_kind_of_target_follows_from_what_is_written(archive, tmp_path):
    found = nacre.load(archive)
    for name in ("x", "x.csv", "x.png"):
        assert_refused(lambda name=name: nacre.save(found, tmp_path / name), name, ".npz", ".btf")
    assert_refused(lambda: nacre.save(found, tmp_path / "x.binary"), "MERL files hold one material")
    assert_refused(lambda: nacre.save(gray(), tmp_path / "x.btf"), "files hold a texture")
    nacre.save(gray(), tmp_path / "y.npz")
    assert nacre.load(tmp_path / "y.npz").isotropic


def test_options_are_those_of_the_format(archive, tmp_path):
    words = "quantity: is not for NumPy archive of a BTF files"
    assert_refused(lambda: nacre.load(archive, quantity="radiance"), words)
    assert nacre.load(archive, quantity=None).name == "x"
    found = nacre.load(archive)
    assert_refused(lambda: nacre.save(found, tmp_path / "y.npz", speed=3), "speed: is not for")


def test_a_list_of_photographs_is_no_scan(tmp_path):
    for separator in (",", ";", "\t"):
        columns = separator.join(("file", "theta_l", "phi_l", "theta_v", "phi_v"))
        (tmp_path / "list.csv").write_text(f"# a remark\n\n{columns}\n")
        assert formats.identify(tmp_path / "list.csv").name == "photographs"
    (tmp_path / "list.csv").write_text("theta_i,phi_i,theta_o,phi_o,f\n")
    assert formats.identify(tmp_path / "list.csv").name == "comma-separated samples"


# Neither materials nor textures

BASIS = Path(nacre.__file__).with_name("latent") / "published.safetensors"


def test_other_files_of_ours_are_named(tmp_path):
    for path, words in ((BASIS, "latent basis"), (CODEC, "texture codec")):
        assert words in formats.describe_kind(path)
        assert_refused(lambda path=path: nacre.load(path), "holds no material", words)
    nacre.save(gray(), tmp_path / "x.npz")
    assert formats.describe_kind(tmp_path / "x.npz") == "one material (MERL array (.npz))"
    for path in (tmp_path, tmp_path / "absent"):
        assert formats.describe_kind(path) == ""


def test_a_pipe_does_not_block(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for read in (nacre.load, formats.identify, formats.load_brdf, formats.load_btf):
        assert_refused(lambda read=read: read(tmp_path / "pipe"), "is not a regular file")
    assert not formats.is_btf(tmp_path / "pipe")
    assert formats.describe_kind(tmp_path / "pipe") == ""


# Where a material came from


def test_a_file_is_hashed_when_that_is_asked_for(tmp_path, monkeypatch):
    path = tmp_path / "x.binary"
    nacre.save(gray(), path)
    opened = []
    real = type(path).open
    monkeypatch.setattr(type(path), "open", lambda *a, **k: opened.append(a[0]) or real(*a, **k))
    found = nacre.load(path)
    assert len(opened) <= 2  # its head, and all of it
    assert found.source["file"] == "x.binary"
    before = len(opened)
    assert found.source["sha256"] == found.source["sha256"] == digest(path)
    assert len(opened) - before == 2  # ours, and that of this test


def test_the_hash_of_a_file_that_has_changed_is_not_known(tmp_path):
    path = tmp_path / "x.binary"
    nacre.save(gray(), path)
    known, unknown, gone = (nacre.load(path).source for _ in range(3))
    assert len(dict(known)) == 2
    path.write_bytes(path.read_bytes() + b"more")
    assert dict(unknown) == {"file": "x.binary"}
    assert unknown.get("sha256") is None
    path.unlink()
    assert dict(gone) == {"file": "x.binary"}
    assert len(known["sha256"]) == 64


def test_the_public_names_exist():
    for name in nacre.__all__:
        assert getattr(nacre, name) is not None
    assert set(nacre.__all__) - {"__version__"} <= set(dir(nacre))
    with pytest.raises(AttributeError, match="nonsense"):
        nacre.nonsense  # noqa: B018
