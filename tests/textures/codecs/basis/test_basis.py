"""The default codec: its parts against closed forms, and the whole on made textures."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.array import Floats
from nacre.btf import TableBtf
from nacre.errors import NacreError
from nacre.geometry import join
from nacre.measured.textures import UTIA
from nacre.measured.textures.domes import BONN, Dome, below, pairs
from nacre.numerics.channels import CHROMA, CHROMA_PERMUTATIONS, LUMA, PERMUTATIONS, split_colors
from nacre.numerics.mlp import Layer
from nacre.numerics.pca import leading_components
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.colors import (
    join_components,
    join_reflectance,
    split_reflectance,
)
from nacre.textures.codecs.basis.networks import FunctionValues, SkipNetwork
from nacre.textures.codecs.basis.posterior import Observation, Prior, project
from nacre.textures.codecs.basis.training import uniform_texels
from nacre.textures.codecs.symmetry import symmetric_rotations
from tests.textures.support import run_of

SMALL = Dome("small", ((0.0, 1, 0.0), (30.0, 6, 0.0), (60.0, 6, 0.0)))


def random_network(inputs: int, outputs: int, seen: int = 0) -> SkipNetwork:
    """Of 7 hidden units, about as strong as its linear map."""
    random = np.random.default_rng(5)

    def layer(a: int, b: int) -> Layer:
        return Layer(random.normal(0, 0.4, (a, b)), random.normal(0, 0.4, b))

    linear = random.normal(0, 0.4, (inputs, outputs)).astype(np.float32)
    return SkipNetwork(linear, [layer(seen or inputs, 7), layer(7, 7), layer(7, outputs)])


def joined(grey: Floats, chroma: Floats) -> Floats:
    """Colors of gray values and pairs."""
    return np.float32(LUMA) * grey[..., None] + np.moveaxis(chroma, 0, -1) @ CHROMA


def test_colors_are_split_and_joined() -> None:
    rgb = np.random.default_rng(0).random((4, 5, 3)).astype(np.float32)
    grey, chroma = split_colors(rgb)
    np.testing.assert_allclose(joined(grey, chroma), rgb, atol=1e-6)
    np.testing.assert_allclose(
        np.square(rgb).sum(-1), np.square(grey) + np.square(chroma).sum(0), rtol=1e-5
    )


def test_reflectance_is_split_less_the_mean_and_joined() -> None:
    random = np.random.default_rng(2)
    rgb = random.random((4, 5, 3)).astype(np.float32)
    mean = random.random(5).astype(np.float32)
    grey, chroma = split_reflectance(rgb, mean)
    wanted = split_colors(np.sqrt(rgb))
    np.testing.assert_allclose(grey, wanted[0] - mean, atol=1e-6)
    np.testing.assert_allclose(chroma, wanted[1], atol=1e-6)
    again = np.empty_like(rgb)
    join_reflectance(grey + mean, chroma, again)
    np.testing.assert_allclose(again, rgb, atol=1e-6)


def test_dark_reflectance_keeps_its_grey_value_and_hue() -> None:
    grey = np.array([[0.1, 0.1, -0.2]], np.float32)
    chroma = np.array([[[0.5, 0.01, 0.3]], [[0.2, 0.02, 0.1]]], np.float32)
    rgb = np.empty((1, 3, 3), np.float32)
    join_reflectance(grey, chroma, rgb)
    free = joined(grey, chroma)[0]
    limited, same, black = np.sqrt(rgb[0])
    assert limited.min() == pytest.approx(0.0, abs=1e-7)
    assert limited.sum() == pytest.approx(free[0].sum(), rel=1e-5)
    hue, wanted = limited - limited.mean(), free[0] - free[0].mean()
    np.testing.assert_allclose(hue / np.abs(hue).max(), wanted / np.abs(wanted).max(), atol=1e-5)
    np.testing.assert_allclose(same, free[1], atol=1e-7)
    np.testing.assert_array_equal(black, 0.0)
    np.testing.assert_allclose(join(join_components(grey, *chroma)), rgb, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("index", range(6))
def test_orders_of_channels_turn_the_pair(index: int) -> None:
    rgb = np.random.default_rng(1).random((9, 3)).astype(np.float32)
    grey, chroma = split_colors(rgb)
    other_grey, other_chroma = split_colors(rgb[:, PERMUTATIONS[index]])
    np.testing.assert_allclose(other_grey, grey, rtol=1e-5)
    np.testing.assert_allclose(other_chroma.T, chroma.T @ CHROMA_PERMUTATIONS[index], atol=1e-6)


@pytest.mark.parametrize(("dome", "count"), [(SMALL, 6), (UTIA, 2), (BONN, 6)])
def test_turns_that_a_dome_allows(dome: Dome, count: int) -> None:
    wi, wo = dome.pairs()
    turns = symmetric_rotations(wi, wo)
    assert len(turns) == count
    for index, order in enumerate(turns):
        angle = 2.0 * np.pi * index / count
        cos, sin = np.cos(angle), np.sin(angle)
        turned = wi @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
        np.testing.assert_allclose(wi[order], turned, atol=1e-4)


def test_scattered_directions_allow_no_turn() -> None:
    wi, wo = pairs(BONN.directions[:20], BONN.directions[3:9])
    assert len(symmetric_rotations(wi, wo)) == 1


def test_components_are_those_of_the_data_in_all_orders() -> None:
    random = np.random.default_rng(2)
    rows = (random.normal(size=(40, 6)) @ random.normal(size=(6, 30))).astype(np.float32)
    shift = np.roll(np.arange(30), 10)
    orders = [np.arange(30), shift, shift[shift]]
    found, variances = leading_components(rows, orders, 4)
    everything = np.concatenate([rows[:, order] for order in orders])
    _, values, vectors = np.linalg.svd(everything, full_matrices=False)
    np.testing.assert_allclose(variances, values[:4] ** 2 / len(everything), rtol=1e-4)
    captured = np.square(everything @ found).sum()
    np.testing.assert_allclose(captured, np.square(everything @ vectors[:4].T).sum(), rtol=1e-4)


def test_derivatives_of_a_skip_network() -> None:
    torch = pytest.importorskip("torch", reason="autograd is the oracle")
    network = random_network(4, 5)
    x = np.random.default_rng(3).normal(size=(3, 4)).astype(np.float32)
    value, slopes = network.jacobian(x)
    np.testing.assert_allclose(value, network(x), atol=1e-6)

    def same(row: object) -> object:
        state = row
        for layer in network.layers[:-1]:
            weights, biases = map(torch.from_numpy, (layer.weights, layer.biases))
            state = torch.nn.functional.silu(state @ weights + biases)
        last = network.layers[-1]
        linear, weights, biases = map(torch.from_numpy, (network.linear, last.weights, last.biases))
        return row @ linear + state @ weights + biases

    for row, slope in zip(x, slopes, strict=True):
        wanted = torch.autograd.functional.jacobian(same, torch.from_numpy(row))
        np.testing.assert_allclose(slope, wanted.numpy().T, atol=1e-5)


def test_inputs_of_a_network_can_be_held_fixed() -> None:
    network = random_network(4, 2, seen=6)
    x = np.random.default_rng(4).normal(size=(3, 4)).astype(np.float32)
    further = np.array([0.3, -1.0], np.float32)
    whole = np.concatenate([x, np.tile(further, (3, 1))], axis=1)
    first, second, last = network.layers
    state = whole @ first.weights + first.biases
    state = state / (1 + np.exp(-state))
    state = state @ second.weights + second.biases
    state = state / (1 + np.exp(-state))
    wanted = x @ network.linear + state @ last.weights + last.biases
    np.testing.assert_allclose(network.given(further)(x), wanted, atol=1e-5)


def test_a_projection_ends_where_the_derivative_vanishes() -> None:
    decode = random_network(3, 8)
    random = np.random.default_rng(6)
    wanted = decode(random.normal(size=(5, 3)).astype(np.float32))
    wanted += random.normal(0, 0.1, wanted.shape).astype(np.float32)
    start = np.zeros((5, 3), np.float32)
    codes = project(start, wanted, decode, 30)
    value, slopes = decode.jacobian(codes)
    gradient = (slopes @ (wanted - value)[..., None])[..., 0]
    assert np.abs(gradient).max() < 1e-3
    assert (np.square(wanted - value).sum(1) < np.square(wanted - decode(start)).sum(1)).all()


def made_functions(count: int) -> FunctionValues:
    random = np.random.default_rng(7)
    shapes = ((count,), (count, 4), (count, 2))
    mean, grey, chroma = (random.normal(size=s).astype(np.float32) for s in shapes)
    return FunctionValues(mean + 12.0, grey, chroma)


def made_prior(count: int) -> Prior:
    return Prior(np.ones(count, np.float32), 1e-9, np.eye(count, dtype=np.float32), 1e-9)


def test_least_squares_find_coefficients() -> None:
    functions = made_functions(50)
    observation = Observation(functions, made_prior(8))
    truth = np.random.default_rng(8).normal(size=(3, 8)).astype(np.float32)
    grey = truth[:, :4] @ functions.luma.T + functions.mean
    chroma = np.stack([truth[:, 4:6] @ functions.chroma.T, truth[:, 6:] @ functions.chroma.T])
    moments = observation.moments(np.square(joined(grey, chroma)))
    np.testing.assert_allclose(observation.ridge(moments), truth, atol=1e-4)
    np.testing.assert_allclose(observation.known, 1.0, atol=1e-6)
    np.testing.assert_allclose(observation.expected(0 * truth, moments), truth, atol=1e-3)


def test_without_observation_a_guess_stands() -> None:
    observation = Observation(made_functions(50).at(np.arange(0)), made_prior(8))
    guess = np.random.default_rng(9).normal(size=(3, 8)).astype(np.float32)
    moments = observation.moments(np.empty((3, 0, 3), np.float32))
    np.testing.assert_array_equal(observation.expected(guess, moments), guess)
    np.testing.assert_array_equal(observation.known, 0.0)


def made_texture(seed: int, wi: Floats, wo: Floats) -> TableBtf:
    """8 x 8 texels: colored diffuse surfaces in various directions, with a soft highlight."""
    random = np.random.default_rng(seed)
    normals = np.concatenate([random.normal(0, 0.2, (64, 2)), np.ones((64, 1))], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    half = wi + wo
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    diffuse = np.maximum(normals @ wi.T, 0.0)[..., None] * random.random((64, 1, 3))
    gloss = np.maximum(normals @ half.T, 0.0) ** 8 * random.random((64, 1))
    values = (diffuse + 0.5 * gloss[..., None]).reshape(8, 8, len(wi), 3)
    return TableBtf(values.astype(np.float32), wi, wo, f"made{seed}")


@pytest.fixture(scope="module")
def codec():
    pytest.importorskip("torch", reason="training takes PyTorch")
    from nacre.textures.codecs.basis.recipe import BasisRecipe

    recipe = BasisRecipe(
        code_dim=8, luma_count=12, chroma_count=4, width=32, wide=64, hidden=32, completing=32,
        texels=64, coded_texels=64, function_steps=400, code_steps=400,
    )  # fmt: skip
    wi, wo = SMALL.pairs()
    textures = [lambda seed=seed: made_texture(seed, wi, wo) for seed in range(6)]
    return BasisCodec.train(run_of(textures), recipe)


def relative_error(decoded: Floats, texels: Floats) -> float:
    """Of squares, against what a mean over all texels leaves."""
    spread = np.square(texels - texels.mean(axis=0)).mean()
    return float(np.square(decoded - texels).mean() / spread)


def test_an_unseen_texture_comes_back(codec) -> None:
    wi, wo = SMALL.pairs()
    texels = made_texture(99, wi, wo).texels(slice(None))
    codes = codec.encoder(wi, wo)(texels)
    assert codes.shape == (64, 8)
    whole = relative_error(codec.decoder(wi, wo)(codes), texels)
    assert whole < 0.02
    some = np.random.default_rng(0).permutation(len(wi))[:60]
    few = codec.encoder(wi[some], wo[some])(texels[:, some])
    assert relative_error(codec.decoder(wi, wo)(few), texels) < 0.06


def test_steep_views_are_guessed_from_the_others(codec) -> None:
    wi, wo = SMALL.pairs()
    texels = made_texture(98, wi, wo).texels(slice(None))
    near = below(wo, 45.0)
    codes = codec.encoder(wi[near], wo[near])(texels[:, near])
    assert relative_error(codec.decoder(wi, wo)(codes)[:, ~near], texels[:, ~near]) < 0.3


def test_directions_of_another_dome_are_encoded_and_decoded(codec) -> None:
    wi, wo = (w[::7] for w in UTIA.pairs())
    inside = below(wi, 61.0) & below(wo, 61.0)
    wi, wo = wi[inside], wo[inside]
    texels = made_texture(97, wi, wo).texels(slice(None))
    codes = codec.encoder(wi, wo)(texels)
    assert relative_error(codec.decoder(wi, wo)(codes), texels) < 0.25


def test_the_same_seed_gives_the_same_codec(codec) -> None:
    from nacre.textures.codecs.basis.recipe import BasisRecipe

    wi, wo = SMALL.pairs()
    recipe = BasisRecipe(
        code_dim=4, luma_count=5, chroma_count=2, width=8, wide=8, hidden=8, completing=8,
        texels=30, coded_texels=20, function_steps=20, code_steps=20,
    )  # fmt: skip
    textures = [lambda: made_texture(0, wi, wo)]
    one, other = (
        BasisCodec.train(run_of(textures), recipe),
        BasisCodec.train(run_of(textures), recipe),
    )
    np.testing.assert_array_equal(one.decode.linear, other.decode.linear)
    np.testing.assert_array_equal(one.functions.last.weights, other.functions.last.weights)


def small_recipe(**sizes: int):
    """Of a training that takes a moment."""
    pytest.importorskip("torch", reason="training takes PyTorch")
    from nacre.textures.codecs.basis.recipe import BasisRecipe

    given = {"code_dim": 4, "luma_count": 6, "chroma_count": 2, "texels": 20, "coded_texels": 20}
    few = {"width": 8, "wide": 8, "hidden": 8, "completing": 8}
    return BasisRecipe(**(given | few | {"function_steps": 20, "code_steps": 20} | sizes))


def test_gray_textures_leave_colors_to_uniform_texels() -> None:
    recipe = small_recipe()

    wi, wo = SMALL.pairs()

    def grey(seed: int) -> TableBtf:
        values = made_texture(seed, wi, wo).values.mean(-1, keepdims=True)
        return TableBtf(np.repeat(values, 3, -1), wi, wo)

    codec = BasisCodec.train(run_of([lambda seed=seed: grey(seed) for seed in range(3)]), recipe)
    assert (codec.functions.luma_count, codec.functions.chroma_count) == (6, 1)
    even = codec.functions(wi, wo).chroma[:, 0]
    assert even.std() < 0.1 * abs(even.mean())


def test_one_texture_is_enough_to_learn_from() -> None:
    recipe = small_recipe(texels=1)

    wi, wo = SMALL.pairs()
    codec = BasisCodec.train(run_of([lambda: made_texture(0, wi, wo)]), recipe)
    assert codec.functions.luma_count == 6


def test_cards_of_one_color_come_back(codec) -> None:
    wi, wo = SMALL.pairs()
    texels = uniform_texels(wi, wo, 50, 12345).texels(slice(None))
    for some in (slice(None), slice(None, None, 9)):
        decoded = codec.decoder(wi, wo)(codec.encoder(wi[some], wo[some])(texels[:, some]))
        assert np.square(decoded - texels).mean() < 0.03 * np.square(texels).mean()


def test_more_functions_than_pairs_are_cut() -> None:
    recipe = small_recipe(luma_count=96, chroma_count=16)

    wi, wo = (w[:40] for w in SMALL.pairs())
    textures = [lambda seed=seed: made_texture(seed, wi, wo) for seed in range(3)]
    codec = BasisCodec.train(run_of(textures), recipe)
    assert codec.functions.luma_count <= 40
    assert codec.decoder(wi, wo)(np.zeros((1, 4), np.float32)).shape == (1, 40, 3)


@pytest.mark.parametrize(
    ("level", "message"), [(0.5, "texels vary in 3 ways"), (1e5, "too large for float16")]
)
def test_textures_to_learn_nothing_from_are_refused(level: float, message: str) -> None:
    recipe = small_recipe()

    wi, wo = SMALL.pairs()
    even = TableBtf(np.full((8, 8, len(wi), 3), level, np.float32), wi, wo, "even")
    with pytest.raises(NacreError, match=message):
        BasisCodec.train(run_of([lambda: even]), recipe)


def test_training_takes_no_more_texels_than_memory_has_room_for() -> None:
    recipe = small_recipe(memory=1 << 18)
    from nacre.textures.codecs.basis import training

    wi, wo = SMALL.pairs()
    found = training._texels_of(lambda: made_texture(0, wi, wo), recipe, 0, 2)
    assert found.values.nbytes * 3 <= recipe.memory // 2
    assert len(found.values) >= 1


def test_textures_of_other_directions_are_refused() -> None:
    pytest.importorskip("torch", reason="training takes PyTorch")
    from nacre.textures.codecs.basis.recipe import BasisRecipe

    wi, wo = SMALL.pairs()
    textures = [lambda: made_texture(0, wi, wo), lambda: made_texture(1, wi[:-1], wo[:-1])]
    with pytest.raises(NacreError, match="made1: is not measured at the directions of made0"):
        BasisCodec.train(run_of(textures), BasisRecipe())
    with pytest.raises(NacreError, match="at least 128 texels to learn from; there are 0"):
        BasisCodec.train(run_of([]), BasisRecipe())


@pytest.mark.parametrize(("name", "value"), [("code_dim", 0), ("hidden", -1), ("seed", -1)])
def test_recipes_of_nothing_are_refused(name: str, value: int) -> None:
    from nacre.textures.codecs.basis.recipe import BasisRecipe

    with pytest.raises(ValueError, match=f"{name} is {value}"):
        BasisRecipe(**{name: value})


def test_recipes_have_no_more_values_than_coefficients() -> None:
    from nacre.textures.codecs.basis.recipe import BasisRecipe

    with pytest.raises(ValueError, match="20 values, of 12 coefficients"):
        BasisRecipe(code_dim=20, luma_count=8, chroma_count=2)
