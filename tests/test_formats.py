"""The registry: reading by content, writing by name, clear refusals."""

from __future__ import annotations

import numpy as np
import pytest

import nacre
from nacre import formats
from nacre.errors import FormatError
from nacre.io.format import Format
from nacre.measured import utia
from nacre.neural import Layer, NeuralBrdf
from tests.specimens import SPECIMENS


def grey() -> NeuralBrdf:
    return NeuralBrdf([Layer(np.zeros((6, 3), np.float32), np.full(3, 0.2, np.float32))])


@pytest.mark.parametrize(
    "ending", [".safetensors", ".h5", ".binary", ".bin", ".bsdf", ".npz", ".exr"]
)
def test_every_writable_format_round_trips_through_the_registry(tmp_path, ending):
    path = tmp_path / f"grey{ending}"
    nacre.save(grey(), path)
    back = nacre.load(path)
    tolerance = 1e-3 if ending == ".bsdf" else 1e-5  # the adaptive grid is not at the directions
    wi = np.array([[0.1, 0.2, 0.9], [0.5, 0.0, 0.8]])
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    np.testing.assert_allclose(back.eval(wi, wi[::-1]), np.exp(0.2) - 1, rtol=tolerance)
    assert back.name == "grey"
    assert back.source["file"] == path.name
    assert len(back.source["sha256"]) == 64


def test_content_decides_over_a_wrong_ending(tmp_path):
    nacre.save(grey(), tmp_path / "grey.binary")
    (tmp_path / "grey.binary").rename(tmp_path / "grey.bsdf")
    assert type(nacre.load(tmp_path / "grey.bsdf")).__name__ == "MerlBrdf"


RECOGNISED = [e.name for e in formats.formats() if e.recognize and e.name in SPECIMENS]


@pytest.mark.parametrize("name", [n for n in RECOGNISED if "(NumPy)" not in n])
def test_content_decides_where_the_ending_says_nothing(tmp_path, name):
    """But for networks in `.npy` sets, whose names say what they hold."""
    specimen = SPECIMENS[name]
    for number, content in enumerate(specimen.files()):
        own, other = tmp_path / f"{number}-{specimen.name}", tmp_path / f"{number}.txt"
        own.write_bytes(content)
        other.write_bytes(content)
        read = nacre.load(own)
        assert nacre.load(other).describe() | {"name": read.name} == read.describe()


@pytest.mark.parametrize("ending", [e for entry in formats.formats() for e in entry.extensions])
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"\x00", "no known format|something else"),
        (b"hello, this is a text file and no material at all", "no known format|something else"),
        (None, "No such file"),
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
        nacre.save(grey(), tmp_path / name)
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
    isotropic, anisotropic = grey(), utia.tabulate(grey())
    for name in ("x.binary", "x.npz", "x.h5"):
        with pytest.raises(FormatError, match="hold isotropic reflectance only"):
            formats.check_target(tmp_path / name, anisotropic)
        formats.check_target(tmp_path / name, isotropic)
    formats.check_target(tmp_path / "x.bsdf", anisotropic)


def test_a_new_format_can_be_registered(tmp_path, monkeypatch):
    monkeypatch.setattr(formats, "_formats", list(formats.formats()))
    (tmp_path / "x.mine").write_bytes(b"MINE")
    formats.register(Format("mine", (".mine",), lambda h: h == b"MINE", lambda path: grey()))
    assert nacre.load(tmp_path / "x.mine").name == "x"


def test_the_public_names_exist():
    for name in nacre.__all__:
        assert getattr(nacre, name) is not None
    assert set(nacre.__all__) - {"__version__"} <= set(dir(nacre))
    with pytest.raises(AttributeError, match="nonsense"):
        nacre.nonsense  # noqa: B018
