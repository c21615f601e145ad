"""Every writer: what it wrote comes back, and a write that fails leaves what was there."""

from __future__ import annotations

import itertools
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import nacre
from nacre import formats
from nacre.brdf import Brdf, CosineSampler
from nacre.errors import FormatError
from nacre.io.files import atomic_path
from nacre.io.format import Format
from nacre.io.outputs import overwrite
from nacre.measured import MerlBrdf, ScatteredBrdf, UtiaBrdf, rgl, rgl_tables
from nacre.measured.utia import SHAPE
from nacre.neural import Layer, NeuralBrdf
from nacre.neural.file import load as load_network
from nacre.neural.published import load_h5
from nacre.sampling import BlinnPhongMixture
from tests.measured.support import hemisphere, material, tensor_bytes
from tests.sampling.mixtures import MIXTURES
from tests.specimens import SPECIMENS

WRITABLE = [entry for entry in formats.formats("brdf") if entry.save is not None]
QUICK = settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def read(entry: Format, folder: Path) -> Brdf:
    """A whole small material of a format; isotropic, so that it can be written."""
    source = folder / f"source-{SPECIMENS[entry.name].name}"
    source.write_bytes(SPECIMENS[entry.name].files()[0])
    brdf: Brdf = entry.load(source)
    source.unlink()
    return brdf


@contextmanager
def full_disk(size: int) -> Iterator[None]:
    """No file can grow beyond `size` bytes: what a writer meets on a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("entry", WRITABLE, ids=lambda entry: entry.name)
def test_a_full_disk_leaves_the_old_file_and_nothing_else(entry: Format, tmp_path: Path) -> None:
    brdf = read(entry, tmp_path)
    path = tmp_path / SPECIMENS[entry.name].name
    entry.save(brdf, path)
    whole = path.read_bytes()
    for old in (b"old", None):
        for size in (0, 1, len(whole) // 2, len(whole) - 1):
            path.unlink(missing_ok=True)
            if old is not None:
                path.write_bytes(old)
            with (
                full_disk(size),
                overwrite(),
                pytest.raises(FormatError, match="cannot be written") as caught,
            ):
                entry.save(brdf, path)
            assert str(path) in str(caught.value)
            assert "\n" not in str(caught.value)
            assert [p.read_bytes() for p in tmp_path.iterdir()] == [old] * (old is not None)
    entry.save(brdf, path)
    assert path.read_bytes() == whole


KILLED = """
import os, signal, sys
from nacre import formats
from nacre.io.outputs import overwrite
os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL)
with overwrite():
    formats.save(formats.load(sys.argv[1]), sys.argv[2])
"""


class Blinding(Brdf):
    """f_r at the largest float32."""

    def eval_components(self, wi, wo):
        f = 1e39 + 0.0 * (wi[2] + wo[2])
        return f, f, f


@pytest.mark.parametrize("ending", [".binary", ".npz", ".mbsdf", ".bin", ".exr", ".csv", ".bsdf"])
def test_values_that_a_file_cannot_hold_are_bounded(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"x{ending}"
    resolutions = {".binary": (6, 6, 6), ".npz": (6, 6, 6), ".mbsdf": (6, 6)}
    resolution = (resolutions | {".bsdf": (1, 6, 8, 8, 16)}).get(ending)
    formats.writer(path, resolution)(Blinding(), path)
    f_r = nacre.load(path).eval([0.0, 0.0, 1.0], [0.6, 0.0, 0.8])
    assert np.isfinite(f_r).all()
    assert (f_r > 1e28).all()


def test_a_killed_writer_leaves_the_old_file_and_does_not_hinder_the_next(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    source, path = tmp_path / "source.binary", tmp_path / "folder" / "paint.binary"
    source.write_bytes(SPECIMENS["MERL"].files()[0])
    path.write_bytes(b"old")
    command = [sys.executable, "-c", KILLED, str(source), str(path)]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    assert path.read_bytes() == b"old"
    (left,) = (p for p in path.parent.iterdir() if p != path)
    assert left.name.startswith(".")
    nacre.save(nacre.load(source), path.with_name("other.binary"))
    assert left.exists()
    with overwrite():
        nacre.save(nacre.load(source), path)
    assert path.stat().st_size == source.stat().st_size
    assert sorted(p.name for p in path.parent.iterdir()) == ["other.binary", "paint.binary"]


def test_what_another_process_is_writing_stays(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    with atomic_path(path) as mine:
        mine.write_text("mine")
        script = "import sys; from nacre.io.files import atomic_path\n"
        script += "with atomic_path(sys.argv[1]) as path: path.write_text('theirs')"
        subprocess.run([sys.executable, "-c", script, str(path)], check=True)
        assert path.read_text().startswith("theirs")
    assert path.read_text().startswith("mine")
    assert list(tmp_path.iterdir()) == [path]


# Round trips


def finite(width: int = 32, **options: float) -> st.SearchStrategy[float]:
    return st.floats(width=width, allow_nan=False, allow_infinity=False, **options)


shapes = st.tuples(*[st.integers(1, 4)] * 3)
merl_tables = shapes.flatmap(lambda shape: arrays(np.float32, (3, *shape), elements=finite()))


@QUICK
@given(merl_tables, st.sampled_from([".binary", ".npz"]))
def test_tables_come_back(tmp_path: Path, table: np.ndarray, ending: str) -> None:
    if ending == ".npz":
        table = np.clip(table, -1e30, 1e30)  # values near the largest float32 are refused there
    path, again = tmp_path / f"table{ending}", tmp_path / f"again{ending}"
    nacre.save(MerlBrdf(table), path)
    back = nacre.load(path)
    assert isinstance(back, MerlBrdf)
    if ending == ".binary":
        np.testing.assert_array_equal(back.stored, table)
    np.testing.assert_allclose(back.stored, table, rtol=1e-6, atol=1e-44)
    np.testing.assert_array_equal(back.mask, MerlBrdf(table).mask)
    nacre.save(back, again)
    assert again.read_bytes() == path.read_bytes()


@settings(QUICK, max_examples=8)
@given(st.integers(0, 2**32), st.lists(finite(), min_size=1, max_size=9))
def test_utia_tables_come_back(tmp_path: Path, seed: int, values: list[float]) -> None:
    random = np.random.default_rng(seed)
    table = random.choice(np.array(values, np.float32), SHAPE)
    nacre.save(UtiaBrdf(table), tmp_path / "table.bin")
    back = nacre.load(tmp_path / "table.bin")
    assert isinstance(back, UtiaBrdf)
    np.testing.assert_array_equal(back.stored, table)


@settings(QUICK, max_examples=10)
@given(
    st.integers(0, 2**32),
    st.sampled_from([[0.0], [-1.0, 1.0], np.linspace(-np.pi, np.pi, 5)]),
    arrays(np.uint16, st.integers(1, 5)),
    st.booleans(),
)
def test_rgl_tables_come_back(
    tmp_path: Path, seed: int, phi_i: list[float], other: np.ndarray, jacobian: bool
) -> None:
    fields = material(phi_i, seed, size=6) | {"other": other}
    fields["jacobian"] = np.array([jacobian], np.uint8)
    path = tmp_path / "source.bsdf"
    path.write_bytes(tensor_bytes(fields))
    nacre.save(rgl.RglBrdf(rgl_tables.read_tables(path)), tmp_path / "again.bsdf")
    back = rgl_tables.read_tables(tmp_path / "again.bsdf")
    for name in ("phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance", "rgb"):
        np.testing.assert_array_equal(getattr(back, name), fields[name])
    np.testing.assert_array_equal(back.others["other"], other)
    assert back.jacobian == jacobian
    assert back.description == "synthetic"


names = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), max_size=12).filter(
    lambda name: name == name.strip(",;")  # which spreadsheets pad lines with
)


@QUICK
@given(
    st.integers(0, 2**32),
    st.integers(1, 20),
    st.booleans(),
    names,
    finite(64, min_value=-1e30, max_value=1e30),
)
def test_scattered_samples_come_back(
    tmp_path: Path, seed: int, count: int, isotropic: bool, name: str, value: float
) -> None:
    random = np.random.default_rng(seed)
    wi, wo = hemisphere(random, count), hemisphere(random, count)
    wi[:, 2], wo[:, 2] = np.maximum(wi[:, 2], 0.01), np.maximum(wo[:, 2], 0.01)
    rgb = random.random((count, 3))
    rgb[0, 1] = value
    brdf = ScatteredBrdf(wi, wo, rgb, name, isotropic=isotropic)
    nacre.save(brdf, tmp_path / "one.csv")
    back = nacre.load(tmp_path / "one.csv")
    assert isinstance(back, ScatteredBrdf)
    assert back.name == (name or "one")
    assert back.isotropic == isotropic
    np.testing.assert_allclose(back.samples.wi, brdf.samples.wi, atol=2e-9)
    np.testing.assert_allclose(back.samples.wo, brdf.samples.wo, atol=2e-9)
    np.testing.assert_allclose(back.samples.rgb, brdf.samples.rgb, rtol=1e-8)


widths = st.lists(st.integers(1, 6), max_size=3).map(lambda hidden: (6, *hidden, 3))


@st.composite
def networks(draw: Callable, isotropic: bool | None = None) -> NeuralBrdf:
    sizes = draw(widths)
    weights = finite(min_value=-1e3, max_value=1e3)
    layers = [
        Layer(draw(arrays(np.float32, (a, b), elements=weights)),
              draw(arrays(np.float32, b, elements=weights)))
        for a, b in itertools.pairwise(sizes)
    ]  # fmt: skip
    lobes = st.one_of(
        st.builds(BlinnPhongMixture, st.floats(0.0, 1.0), st.floats(1.0, 1e3)),
        st.sampled_from(list(MIXTURES.values())),
    )
    if isotropic is None:
        isotropic = draw(st.booleans())
    sampler = draw(st.one_of(st.just(CosineSampler()), lobes))
    json = st.dictionaries(st.text(max_size=5), st.one_of(finite(64), names), max_size=3)
    name, fit = draw(names), draw(json)
    return NeuralBrdf(
        layers, isotropic=isotropic, name=name, sampler=sampler, metadata={"fit": fit}
    )


def assert_same_layers(one: NeuralBrdf, other: NeuralBrdf) -> None:
    assert one.sizes == other.sizes
    for a, b in zip(one.layers, other.layers, strict=True):
        np.testing.assert_array_equal(a.weights, b.weights)
        np.testing.assert_array_equal(a.biases, b.biases)


@QUICK
@given(networks())
def test_neural_materials_come_back(tmp_path: Path, network: NeuralBrdf) -> None:
    path, again = tmp_path / "paint.safetensors", tmp_path / "again.safetensors"
    nacre.save(network, path)
    back = load_network(path)
    assert_same_layers(back, network)
    assert (back.name, back.isotropic) == (network.name, network.isotropic)
    assert back.metadata == network.metadata
    assert type(back.sampler) is type(network.sampler)
    nacre.save(back, again)
    assert again.read_bytes() == path.read_bytes()


@settings(QUICK, max_examples=10)
@given(networks(isotropic=True))
def test_keras_weights_come_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, network: NeuralBrdf
) -> None:
    monkeypatch.setattr("nacre.neural.published.fit_lobes", lambda _: CosineSampler())  # slow
    nacre.save(network, tmp_path / "paint.h5")
    assert_same_layers(load_h5(tmp_path / "paint.h5"), network)
