"""Files of bases and codes: exact round trips, and bad input."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest
import safetensors.numpy

import nacre
from nacre.errors import FormatError
from nacre.latent import Autoencoder
from nacre.latent.file import KEY, load_basis, load_code, save_basis, save_code
from tests.latent.made import basis, random_autoencoder, random_basis, random_hypernetwork
from tests.specimens import mutated


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "basis.safetensors"
    save_basis(basis(6), path)
    return path


@pytest.fixture
def neural_path(tmp_path: Path) -> Path:
    path = tmp_path / "basis.safetensors"
    save_basis(random_basis(), path)
    return path


def test_a_basis_comes_back_as_it_was(path):
    before, after = basis(6), load_basis(path)
    for name in ("mask", "center", "components", "uses", "colors", "deviations"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    assert (after.resolution, after.metadata) == (before.resolution, before.metadata)
    save_basis(after, path.with_name("two.safetensors"))
    assert path.with_name("two.safetensors").read_bytes() == path.read_bytes()


def test_a_neural_basis_comes_back_as_it_was(neural_path):
    before, after = random_basis(), load_basis(neural_path)
    for one, other in zip(before.hidden, after.hidden, strict=True):
        np.testing.assert_array_equal(one.weights, other.weights)
        np.testing.assert_array_equal(one.biases, other.biases)
    np.testing.assert_array_equal(before.functions, after.functions)
    assert (after.luma, after.metadata) == (before.luma, before.metadata)
    save_basis(after, neural_path.with_name("two.safetensors"))
    assert neural_path.with_name("two.safetensors").read_bytes() == neural_path.read_bytes()


def test_a_code_of_a_neural_basis_comes_back_as_it_was(neural_path):
    file = neural_path.with_name("x.json")
    before = random_basis().decode(np.linspace(-2.0, 2.0, 6), "Farbe")
    save_code(before, file)
    after = load_code(file, load_basis(neural_path))
    np.testing.assert_array_equal(after.code, before.code)
    assert after.name == "Farbe"
    with pytest.raises(FormatError, match="is not a log-relative PCA code"):
        load_code(file, basis(6))
    with pytest.raises(FormatError, match="another one"):
        load_code(file, random_basis(2, 2))


def test_a_hypernetwork_and_its_codes_come_back_as_they_were(tmp_path):
    path, file = tmp_path / "basis.safetensors", tmp_path / "x.json"
    before = random_hypernetwork()
    save_basis(before, path)
    after = load_basis(path)
    for name, layer in before.layers.items():
        np.testing.assert_array_equal(after.layers[name].weights, layer.weights)
        np.testing.assert_array_equal(after.layers[name].biases, layer.biases)
    np.testing.assert_array_equal(after.basis.functions, before.basis.functions)
    assert (after.nbytes, after.metadata) == (before.nbytes, before.metadata)
    save_basis(after, path.with_name("two.safetensors"))
    assert path.with_name("two.safetensors").read_bytes() == path.read_bytes()
    material = before.decode(np.linspace(-2.0, 2.0, 6), "Farbe")
    save_code(material, file)
    found = load_code(file, after)
    w = np.array([[0.6, 0.0, 0.8]])
    np.testing.assert_array_equal(found.eval(w, w), material.eval(w, w))
    with pytest.raises(FormatError, match="is not a neural code"):
        load_code(file, random_basis())


def test_an_autoencoder_comes_back_as_it_was(tmp_path):
    path = tmp_path / "basis.safetensors"
    before = random_autoencoder()
    save_basis(before, path)
    after = load_basis(path)
    for name, layer in before.layers.items():
        np.testing.assert_array_equal(after.layers[name].weights, layer.weights)
        np.testing.assert_array_equal(after.layers[name].biases, layer.biases)
    np.testing.assert_array_equal(after.common, before.common)
    assert (after.seed, after.metadata) == (before.seed, before.metadata)
    save_basis(after, path.with_name("two.safetensors"))
    assert path.with_name("two.safetensors").read_bytes() == path.read_bytes()


def test_an_autoencoder_that_does_not_say_its_epochs_had_40():
    header, tensors = random_autoencoder().pack()
    assert header.pop("epochs") == random_autoencoder().epochs != 40
    old = Autoencoder.unpack({**header, "metadata": {}}, tensors)
    assert old.epochs == 40
    assert old.pack()[0] == header  # and codes keep their checksum
    with pytest.raises(ValueError, match="epochs"):
        replace(old, epochs=0)


def test_a_code_comes_back_as_it_was(path):
    file = path.with_name("x.json")
    before = basis(6).decode(np.linspace(-2.0, 2.0, 6), "Farbe")
    save_code(before, file)
    after = load_code(file, load_basis(path))
    np.testing.assert_array_equal(after.code, before.code)
    np.testing.assert_array_equal(after.stored, before.stored)
    assert after.name == "Farbe"


def test_a_code_belongs_to_its_basis(path):
    file = path.with_name("x.json")
    save_code(basis(5).decode(np.zeros(5)), file)
    with pytest.raises(FormatError, match=r"x\.json: basis: .* another one"):
        load_code(file, load_basis(path))


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("values", [0.0] * 5, "6 values"),
        ("values", [0.0] * 5 + [float("nan")], "below a million"),
        ("values", [0.0] * 5 + [1e300], "below a million"),
        ("values", ["x"] * 6, "values"),
        ("values", 3, "values are not a list of numbers"),
        ("values", [None] * 6, "values are not a list of numbers"),
        ("values", None, "values are not a list of numbers"),
        ("name", None, "name is not a text"),
        ("name", "half \ud800", "surrogates"),
        ("version", 2, "version 1"),
        ("code of", "other", "version 1"),
        ("basis", "0", "another one"),
    ],
)
def test_a_damaged_code_is_refused(path, field, value, message):
    file = path.with_name("x.json")
    save_code(basis(6).decode(np.zeros(6)), file)
    content = json.loads(file.read_text()) | {field: value}
    file.write_text(json.dumps(content))
    with pytest.raises(FormatError, match=message):
        load_code(file, basis(6))
    del content[field]
    file.write_text(json.dumps(content))
    with pytest.raises(FormatError, match="not a whole code"):
        load_code(file, basis(6))


@pytest.mark.parametrize("kind", [basis, random_basis, random_hypernetwork, random_autoencoder])
def test_a_damaged_basis_is_refused_or_harmless(kind, tmp_path):
    path = tmp_path / "basis.safetensors"
    save_basis(kind(), path)
    whole = path.read_bytes()
    random = Random(1)
    cuts = [whole[:length] for length in (1, 8, 40, 200, len(whole) - 1)]
    for content in cuts + [mutated(whole, random) for _ in range(100)]:
        path.write_bytes(content)
        message = ""
        try:
            made = load_basis(path)
        except FormatError as error:
            message = str(error)
        if message or content in cuts:
            assert message.startswith(str(path))
            assert "\n" not in message
        else:
            w = np.array([[0.6, 0.0, 0.8]])
            assert np.isfinite(made.decode(np.ones(made.code_dim)).eval(w, w)).all()


def test_a_basis_whose_facts_cannot_be_shown_is_refused(tmp_path):
    path = tmp_path / "basis.safetensors"
    save_basis(basis(), path)
    with path.open("rb") as file:
        header, tensors = json.loads(file.read(int.from_bytes(file.read(8), "little"))), file.read()
    own = json.loads(header["__metadata__"][KEY])
    own["metadata"]["materials"] = ["half \ud800"]
    header["__metadata__"][KEY] = json.dumps(own)
    text = json.dumps(header).encode()
    path.write_bytes(len(text).to_bytes(8, "little") + text + tensors)
    with pytest.raises(FormatError, match="surrogates"):
        load_basis(path)


CHANGES = {
    basis: [
        ("mask", lambda a: a[:-1]),
        ("mask", lambda a: 0 * a),
        ("centre", lambda a: a[:-1]),
        ("centre", lambda a: a + np.nan),
        ("centre", lambda a: a.astype(np.float64)),
        ("components", lambda a: a[:, 1:]),
        ("components", lambda a: a * np.float32(1e30)),
        ("uses", lambda a: a + 100),
        ("uses", lambda a: -a - 1),
        ("uses", lambda a: a[:0]),
        ("colours", lambda a: a[:, :2]),
        ("deviations", lambda a: -a),
    ],
    random_basis: [
        ("weights_1", lambda a: a[:-1]),
        ("weights_2", lambda a: a[:, :-1]),
        ("weights_2", lambda a: a * np.float32(1e30)),
        ("biases_1", lambda a: a + np.nan),
        ("biases_2", lambda a: a[:-1]),
        ("functions", lambda a: a[:-1]),
        ("functions", lambda a: a[:, :4]),
        ("functions", lambda a: a.astype(np.float16)),
        ("functions", lambda a: a[0]),
    ],
    random_hypernetwork: [
        ("trunk_weights", lambda a: a[:-1]),
        ("shared_weights", lambda a: a[:, :-1]),
        ("shared_biases", lambda a: a + np.inf),
        ("channel_weights", lambda a: a * np.float32(1e30)),
        ("output_biases", lambda a: a.astype(np.float64)),
        ("functions", lambda a: a[:, :4]),
    ],
    random_autoencoder: [
        ("common", lambda a: a[:-1]),
        ("common", lambda a: a + np.nan),
        ("contract_weights", lambda a: a[:-1]),
        ("code_weights", lambda a: a[:, :-1]),
        ("expand_biases", lambda a: a.astype(np.float16)),
        ("network_weights", lambda a: a * np.float32(1e30)),
    ],
}
"""Of single tensors, by the kind of basis."""


@pytest.mark.parametrize(
    ("kind", "name", "change"), [(kind, *row) for kind, rows in CHANGES.items() for row in rows]
)
def test_tensors_that_do_not_fit_are_refused(tmp_path, kind, name, change):
    path = tmp_path / "basis.safetensors"
    save_basis(kind(), path)
    data = path.read_bytes()
    tensors = safetensors.numpy.load(data)
    tensors[name] = np.ascontiguousarray(change(tensors[name]))
    size = int.from_bytes(data[:8], "little")
    header = json.loads(data[8 : 8 + size])["__metadata__"]
    path.write_bytes(safetensors.numpy.save(tensors, header))
    with pytest.raises(FormatError, match=r"basis\.safetensors"):
        load_basis(path)


@pytest.mark.parametrize(
    "resolution", [[24, 12, 13], [1024, 1024, 1024], [0, 1, 1], [24], "x", None]
)
def test_a_resolution_that_is_not_true_is_refused(path, resolution):
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    text = json.loads(data[8 : 8 + size])["__metadata__"]["nacre basis"]
    header = json.loads(text) | {"resolution": resolution}
    tensors = safetensors.numpy.load(data)
    path.write_bytes(safetensors.numpy.save(tensors, {"nacre basis": json.dumps(header)}))
    with pytest.raises(FormatError, match=r"basis\.safetensors"):
        load_basis(path)


def test_neither_passes_for_a_material(path):
    file = path.with_name("x.json")
    save_code(basis(6).decode(np.zeros(6)), file)
    for wrong, message in ((path, "is a latent basis"), (file, "no known format")):
        with pytest.raises(FormatError, match=message):
            nacre.load(wrong)
    with pytest.raises(FormatError, match="not a whole safetensors"):
        load_basis(file)
