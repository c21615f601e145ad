"""Neural material files: round trips, published networks, damage."""

from __future__ import annotations

import itertools
import json
import math

import h5py
import numpy as np
import pytest
import safetensors.numpy

from nacre.brdf import CosineSampler
from nacre.errors import FormatError
from nacre.geometry import from_rusinkiewicz_angles, half_difference, join
from nacre.neural import Layer, NeuralBrdf
from nacre.neural.file import FORMAT, load, save
from nacre.neural.nbrdf import check_weights, round_layers
from nacre.neural.published import load_h5, load_npy, save_h5
from nacre.sampling import BlinnPhongMixture, UniformSampler
from tests.data import list_data, require_data
from tests.sampling.mixtures import MIXTURES
from tests.specimens.networks import keras_bytes
from tests.tiers import tiered

CHROME = ("merl", "chrome.h5")
PUBLISHED = [
    (folder, name)
    for folder in ("merl", "rgl", "nielsen")
    for name in list_data(f"pretrained/{folder}", "*.h5")
]


def network(sizes=(6, 21, 21, 3), **options):
    random = np.random.default_rng(0)
    layers = [
        Layer(
            random.normal(size=(a, b)).astype(np.float32), random.normal(size=b).astype(np.float32)
        )
        for a, b in itertools.pairwise(sizes)
    ]
    return NeuralBrdf(layers, **options)


def directions(count):
    random = np.random.default_rng(1)
    angles = random.random((4, count)) * np.array([[np.pi / 2], [6.28], [np.pi / 2], [6.28]])
    wi, wo = (join(w) for w in from_rusinkiewicz_angles(*angles))
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    return wi[above], wo[above]


def test_half_precision_takes_half_the_bytes_and_comes_back_the_same(tmp_path):
    single = network()
    half = NeuralBrdf(round_layers(single.layers, "half"), precision="half")
    sizes = []
    for brdf in (single, half):
        path = tmp_path / f"{brdf.precision}.safetensors"
        save(brdf, path)
        sizes.append(path.stat().st_size)
        again = load(path)
        assert again.precision == brdf.precision
        assert again.nbytes == brdf.nbytes
        for a, b in zip(brdf.layers, again.layers, strict=True):
            assert a.weights.dtype == b.weights.dtype == np.float32
            np.testing.assert_array_equal(a.weights, b.weights)
            np.testing.assert_array_equal(a.biases, b.biases)
    assert half.nbytes == 1350
    assert sizes[0] - sizes[1] == pytest.approx(1350, abs=8)  # the header is padded
    wi, wo = directions(500)
    before, after = np.log1p(single.eval(wi, wo)), np.log1p(half.eval(wi, wo))
    assert np.abs(after - before).max() < 2e-2 * before.max()


def test_a_squared_network_is_of_a_version_that_readers_of_relu_refuse(tmp_path):
    plain = network()
    squared = NeuralBrdf(plain.layers, activation="squared relu")
    path = tmp_path / "squared.safetensors"
    save(squared, path)
    assert load(path).activation == "squared relu"
    np.testing.assert_array_equal(load(path).eval(*directions(50)), squared.eval(*directions(50)))
    as_relu = load(rewritten(path, lambda h, t: h.update(version=1)))
    np.testing.assert_array_equal(as_relu.eval(*directions(50)), plain.eval(*directions(50)))


def test_weights_whose_squares_overflow_are_refused():
    layers = [Layer(np.full((6, 9), 1e20), np.zeros(9)), Layer(np.ones((9, 3)), np.zeros(3))]
    check_weights(layers)
    with pytest.raises(ValueError, match="overflow"):
        check_weights(layers, "squared relu")


def test_an_unknown_activation_is_refused():
    with pytest.raises(ValueError, match="unknown activation"):
        NeuralBrdf(network().layers, activation="tanh")


def test_weights_that_a_precision_does_not_hold_are_refused():
    with pytest.raises(ValueError, match="half precision does not hold"):
        NeuralBrdf(network().layers, precision="half")
    with pytest.raises(ValueError, match="unknown precision 'double'"):
        network(precision="double")


def test_a_file_of_mixed_or_other_precision_is_refused(tmp_path):
    path = tmp_path / "x.safetensors"
    save(network(), path)
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    metadata = json.loads(data[8 : 8 + size])["__metadata__"]
    tensors = safetensors.numpy.load(data)
    for wrong in (
        {**tensors, "biases_2": tensors["biases_2"].astype(np.float16)},
        {name: tensor.astype(np.float64) for name, tensor in tensors.items()},
    ):
        path.write_bytes(safetensors.numpy.save(wrong, metadata))
        with pytest.raises(FormatError, match="float32 or float16"):
            load(path)


SAMPLERS = [CosineSampler(), UniformSampler(), BlinnPhongMixture(0.7, 123.0), *MIXTURES.values()]


@pytest.mark.parametrize("sampler", SAMPLERS)
@pytest.mark.parametrize("sizes", [(6, 21, 21, 3), (6, 4, 3), (6, 8, 16, 8, 3)])
@pytest.mark.parametrize("isotropic", [True, False])
def test_a_file_holds_everything(tmp_path, sampler, sizes, isotropic):
    before = network(
        sizes,
        isotropic=isotropic,
        name="Größe 7",
        sampler=sampler,
        metadata={"fit": {"epochs": 3}, "quality": {"held_out_loss": 0.1}},
    )
    save(before, tmp_path / "x.safetensors")
    after = load(tmp_path / "x.safetensors")
    wi, wo = directions(100)
    np.testing.assert_array_equal(after.eval(wi, wo), before.eval(wi, wo))
    np.testing.assert_array_equal(after.pdf(wi, wo), before.pdf(wi, wo))
    assert type(after.sampler) is type(sampler)
    assert after.sampler.describe() == sampler.describe()
    assert (after.name, after.isotropic, after.metadata) == ("Größe 7", isotropic, before.metadata)


def test_the_paper_network_takes_about_2700_bytes_of_weights(tmp_path):
    save(network(), tmp_path / "x.safetensors")
    assert network().weight_count == 675
    assert (tmp_path / "x.safetensors").stat().st_size < 4096


def plain_forward(path, wi, wo):
    """The network of a Keras file in NumPy, without the package's code for it."""
    h, d = half_difference(tuple(wi.T), tuple(wo.T))
    x = np.stack([np.hypot(h[0], h[1]), np.zeros(len(wi)), h[2], *d], axis=1)
    with h5py.File(path) as file:
        for k in (1, 2, 3):
            group = file[f"dense_{k}/dense_{k}"]
            x = x @ group["kernel:0"][()].astype(np.float64) + group["bias:0"][()]
            x = np.maximum(x, 0) if k < 3 else np.maximum(np.exp(x) - 1, 0)
    return x


@pytest.mark.parametrize(
    ("folder", "name"), tiered(PUBLISHED or [CHROME], [CHROME, *PUBLISHED[::12]])
)
def test_a_published_network_evaluates_like_a_plain_forward_pass(folder, name):
    path = require_data("pretrained", folder, name)
    wi, wo = directions(2000)
    expected = plain_forward(path, wi, wo)
    got = load_h5(path).eval(wi, wo)
    np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-5)


def test_keras_files_round_trip(tmp_path):
    before = network()
    save_h5(before, tmp_path / "x.h5")
    after = load_h5(tmp_path / "x.h5")
    for one, other in zip(before.layers, after.layers, strict=True):
        np.testing.assert_array_equal(one.weights, other.weights)
        np.testing.assert_array_equal(one.biases, other.biases)
    with pytest.raises(FormatError, match="isotropic"):
        save_h5(network(isotropic=False), tmp_path / "y.h5")
    assert not (tmp_path / "y.h5").exists()


def write_npy_set(folder, layers):
    for k, layer in enumerate(layers, 1):
        np.save(folder / f"steel_fc{k}.npy", layer.weights)
        np.save(folder / f"steel_b{k}.npy", layer.biases)


def test_numpy_sets_load_by_any_member(tmp_path):
    before = network()
    write_npy_set(tmp_path, before.layers)
    for name in ("steel_fc1.npy", "steel_b3.npy"):
        after = load_npy(tmp_path / name)
        assert after.name == "steel"
        np.testing.assert_array_equal(after.layers[2].weights, before.layers[2].weights)


def test_damaged_numpy_sets_are_named(tmp_path):
    write_npy_set(tmp_path, network().layers)
    whole = (tmp_path / "steel_fc2.npy").read_bytes()
    header = b"\x93NUMPY\x01\x00\x10\x00{(             \n"
    for damaged in (whole[:5], whole[:100], whole[:-1], whole + b"x", b"", whole[:6], header):
        (tmp_path / "steel_fc2.npy").write_bytes(damaged)
        with pytest.raises(FormatError, match="steel_fc2"):
            load_npy(tmp_path / "steel_fc1.npy")
    (tmp_path / "steel_fc2.npy").unlink()
    with pytest.raises(FormatError, match="not an NBRDF"):
        load_npy(tmp_path / "steel_fc1.npy")
    np.save(tmp_path / "other.npy", np.zeros(3))
    with pytest.raises(FormatError, match="expected a name"):
        load_npy(tmp_path / "other.npy")


def rewritten(path, change):
    """A copy of a material file with a changed header or changed tensors."""
    tensors = safetensors.numpy.load_file(path)
    with safetensors.safe_open(path, "np") as file:
        header = json.loads(file.metadata()["nacre"])
    change(header, tensors)
    target = path.with_name("changed.safetensors")
    safetensors.numpy.save_file(tensors, target, {"nacre": json.dumps(header)})
    return target


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda h, t: h.update(version=99), "version 99"),
        (lambda h, t: h.update(model="gan"), "unknown model"),
        (lambda h, t: h.update(parametrisation="polar"), "unknown parametrization"),
        (lambda h, t: h.pop("sampler"), "field 'sampler' is missing"),
        (lambda h, t: h.update(sampler={"kind": "oracle"}), "unknown sampler"),
        (lambda h, t: h.update(sampler=None), "a field of its header has the wrong type"),
        (lambda h, t: h["sampler"].update(exponent=-1), "exponent must lie in"),
        (lambda h, t: h["sampler"].update(exponent=10**400), "too large"),
        (lambda h, t: h.update(fit=[1]), "field 'fit' is not a table"),
        (lambda h, t: h.update(source="x"), "field 'source' is not a table"),
        (lambda h, t: h["sampler"].update(specular=float("nan")), "specular must lie in"),
        (lambda h, t: h.update(sizes=[6, 3]), "6, 21, 21, 3|do not chain|outputs"),
        (lambda h, t: h.update(sizes=[]), "index out of range|layer"),
        (lambda h, t: h.update(sizes=7), "a field of its header has the wrong type"),
        (lambda h, t: t.pop("biases_2"), "field 'biases_2' is missing"),
        (lambda h, t: t.update(weights_1=t["weights_1"] * np.nan), "finite"),
        (lambda h, t: t.update(weights_1=t["weights_1"] * np.float32(1e37)), "overflow"),
        (lambda h, t: h.update(note=float("inf")), "JSON"),
        (lambda h, t: h.update(note="\ud800"), "surrogates"),
        (lambda h, t: h.update(name="\ud800"), "surrogates"),
        (lambda h, t: t.update(weights_1=t["weights_1"].astype(np.float64)), "float32"),
        (lambda h, t: t.update(weights_2=t["weights_2"][:, :3].copy()), "not a layer"),
        (lambda h, t: t.update(biases_3=t["biases_3"][:2].copy()), "not a layer"),
    ],
)
def test_wrong_content_is_named_in_one_line(tmp_path, change, words):
    path = tmp_path / "x.safetensors"
    save(network(sampler=BlinnPhongMixture(0.5, 10.0)), path)
    with pytest.raises(FormatError, match=words) as caught:
        load(rewritten(path, change))
    assert "changed.safetensors" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: s.pop("squared"), "'squared' is missing"),
        (lambda s: s.pop("angle"), "'angle' is missing"),
        (lambda s: s.update(lobes=[]), "1 to 8 lobes"),
        (lambda s: s.update(lobes=s["lobes"] * 500), "1 to 8 lobes"),
        (lambda s: s.update(lobes=[[1.0]]), "a field of its header has the wrong type"),
        (lambda s: s.update(uniform=[0.1] * 5000), "must have 3 values"),
        (lambda s: s.update(uniform=0.1), "a field of its header has the wrong type"),
        (lambda s: s.update(cosines=[0.1, 0.5, "high"]), "could not convert"),
        (lambda s: s["lobes"][0].update(roughness=[0.1, 0.1, 0.0]), "roughness must lie"),
        (lambda s: s["lobes"][0].update(shift=[0.1, math.nan, 0.0]), "shift must lie"),
        (lambda s: s.update(angle="steep"), "could not convert"),
        (lambda s: s.update(kind="cosine + sine"), "unknown sampler"),
    ],
)
def test_wrong_lobes_are_named_in_one_line(tmp_path, change, words):
    path = tmp_path / "x.safetensors"
    save(network(sampler=MIXTURES["two lobes"]), path)
    with pytest.raises(FormatError, match=words) as caught:
        load(rewritten(path, lambda header, _: change(header["sampler"])))
    assert "\n" not in str(caught.value)


class Unregistered(UniformSampler):
    """Of a kind whose name means another class."""


def test_a_sampler_that_cannot_be_stored_is_refused(tmp_path):
    with pytest.raises(FormatError, match="cannot hold a sampler of type Unregistered"):
        save(network(sampler=Unregistered()), tmp_path / "x.safetensors")
    assert not list(tmp_path.iterdir())


def test_keras_files_whose_weights_are_elsewhere_or_packed_are_refused(tmp_path):
    secret = tmp_path / "secret"
    secret.write_bytes(bytes(12))
    for words, options in {
        "stored whole and plain": {"external": [(str(secret), 0, 12)]},
        "whole and plain": {"chunks": (3,), "compression": "gzip"},
        "expected floating-point": {"dtype": "i4"},
    }.items():
        path = tmp_path / f"{words}.h5"
        save_h5(network((6, 3)), path)
        with h5py.File(path, "r+") as file:
            del file["dense_1/dense_1/bias:0"]
            file.create_dataset("dense_1/dense_1/bias:0", (3,), **({"dtype": "f4"} | options))
        with pytest.raises(FormatError, match=words):
            load_h5(path)


def test_a_heap_of_strings_without_end_is_refused(tmp_path):
    """HDF5 itself would never come back from an object that claims no length."""
    path = tmp_path / "x.h5"
    path.write_bytes(keras_bytes({"weights_1": np.zeros((6, 3)), "biases_1": np.zeros(3)}))
    assert load_h5(path).sizes == (6, 3)
    data = bytearray(path.read_bytes())
    first = data.index(b"GCOL") + 16
    for claimed in (2**64 - 16, 2**64 - 1, 1 << 20):
        damaged = data.copy()
        damaged[first + 8 : first + 16] = claimed.to_bytes(8, "little")
        path.write_bytes(bytes(damaged))
        with pytest.raises(FormatError, match="heap of strings is damaged"):
            load_h5(path)
    data[first : first + 16] = bytes(16)
    path.write_bytes(bytes(data))
    with pytest.raises(FormatError, match="heap of strings is damaged"):
        load_h5(path)


@pytest.mark.parametrize(
    ("place", "part"),
    [
        (0, b"\xff\xff\xff\x7f"),  # the length, for which HDF5 would take 2 GiB
        (0, b"\x01\0\0\0"),  # more would be copied
        (4, b"weights_"),  # the address of the heap
        (12, b"\xff\0\0\0"),  # the number there
        (-16, b"\xff\xff\xff\x7f"),  # how many strings there are
    ],
)
def test_strings_that_claim_what_is_not_there_are_refused(tmp_path, place, part):
    path = tmp_path / "x.h5"
    data = bytearray(keras_bytes({"weights_1": np.zeros((6, 3)), "biases_1": np.zeros(3)}))
    for name in (b"layer_names\0", b"weight_names\0"):
        first = data.index(name) + 16 + 24 + 24 + place  # behind name, type and shape, padded
        damaged = data.copy()
        damaged[first : first + len(part)] = part
        path.write_bytes(bytes(damaged))
        with pytest.raises(FormatError, match=r"string|not whole"):
            load_h5(path)
    path.write_bytes(bytes(data))
    assert load_h5(path).sizes == (6, 3)


def test_names_of_fixed_and_of_variable_length_are_read(tmp_path):
    path = tmp_path / "x.h5"
    save_h5(network((6, 3)), path)
    assert load_h5(path).sizes == (6, 3)
    with h5py.File(path, "r+") as file:
        for group, key in ((file, "layer_names"), (file["dense_1"], "weight_names")):
            names = group.attrs[key]
            assert names.dtype.kind == "S"  # as Keras writes and decodes them
            group.attrs[key] = names.astype(h5py.string_dtype("ascii"))
    assert load_h5(path).sizes == (6, 3)


def test_only_neural_materials_are_saved(tmp_path):
    with pytest.raises(FormatError, match="fit the material first"):
        save(object(), tmp_path / "x.safetensors")
    assert not list(tmp_path.iterdir())


def test_layers_that_do_not_fit_are_refused():
    zeros = np.zeros
    with pytest.raises(ValueError, match="not a layer"):
        Layer(zeros((2, 3), np.float32), zeros(2, np.float32))
    with pytest.raises(ValueError, match="do not chain"):
        NeuralBrdf([Layer(zeros((6, 4)), zeros(4)), Layer(zeros((5, 3)), zeros(3))])
    with pytest.raises(ValueError, match="6 inputs to 3 outputs"):
        NeuralBrdf([Layer(zeros((4, 3)), zeros(3))])
    with pytest.raises(ValueError, match="not a layer"):
        Layer(zeros((6, 0)), zeros(0))
    with pytest.raises(ValueError, match="at least one layer"):
        NeuralBrdf([])


def test_metadata_is_kept_and_cannot_overrule_the_network(tmp_path):
    save(
        network(name="true", metadata={"name": "false", "owner": "lab"}), tmp_path / "x.safetensors"
    )
    back = load(tmp_path / "x.safetensors")
    assert (back.name, back.metadata) == ("true", {"owner": "lab"})
    with pytest.raises(FormatError, match="JSON"):
        save(network(metadata={"loss": float("nan")}), tmp_path / "y.safetensors")
    assert not (tmp_path / "y.safetensors").exists()


def test_the_format_holds_networks_only():
    assert (FORMAT.holds, FORMAT.measured, FORMAT.kind) == ("neural", False, "brdf")
    with pytest.raises(FormatError, match="holds neural materials only"):
        FORMAT.save(UniformSampler(), "x.safetensors")
