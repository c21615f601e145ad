"""Principal components, by whichever way, against the singular values of the whole data."""

from __future__ import annotations

import itertools

import numpy as np

from nacre.numerics.channels import split_colors
from nacre.numerics.pca import (
    BY_CHANNEL,
    BY_PERMUTATION,
    largest_first,
    leading_components,
    leading_directions,
    snapshots,
    strongest,
)

RANDOM = np.random.default_rng(4)
ROWS = (RANDOM.normal(size=(40, 6)) * 0.5 ** np.arange(6) @ RANDOM.normal(size=(6, 60))).astype(
    np.float32
)
SINGULAR, VECTORS = np.linalg.svd(ROWS.astype(np.float64), full_matrices=False)[1:]


def alike(found: np.ndarray, count: int, tolerance: float = 1e-3) -> None:
    """Assert that columns are the leading singular vectors, but for their signs."""
    np.testing.assert_allclose(
        np.abs(np.diag(VECTORS[:count] @ found[:, :count])), 1.0, atol=tolerance
    )


def test_eigenvalues_come_largest_first():
    values, vectors = largest_first(np.diag([1.0, 3.0, 2.0]), 2)
    np.testing.assert_allclose(values, [3.0, 2.0])
    np.testing.assert_allclose(np.abs(vectors), np.eye(3)[:, [1, 2]])


def test_snapshots_of_few_rows():
    squares, found = snapshots(lambda: np.array_split(ROWS.astype(np.float64), 7, axis=1), 10)
    assert len(found) == 6  # the rank
    np.testing.assert_allclose(squares, SINGULAR[:6] ** 2, rtol=1e-6)
    alike(found.T, 6)


def test_components_of_rows_that_count_in_several_orders():
    orders = [np.arange(60), np.roll(np.arange(60), 30)]
    every = np.concatenate([ROWS[:, order] for order in orders]).astype(np.float64)
    singular, vectors = np.linalg.svd(every, full_matrices=False)[1:]
    found, variances = leading_components(ROWS, orders, 3)
    np.testing.assert_allclose(variances, singular[:3] ** 2 / len(every), rtol=1e-4)
    np.testing.assert_allclose(np.abs(np.diag(vectors[:3] @ found)), 1.0, atol=1e-3)


def test_directions_of_rows_that_are_read_in_runs():
    found = leading_directions(lambda: ([part] for part in np.array_split(ROWS, 4)), 1, 60, 3, 0)[0]
    alike(found, 3)


def test_luma_and_chroma_are_the_components_of_all_permutations():
    colors = RANDOM.normal(size=(5, 4, 3)) * (1.0, 0.6, 0.3)
    colors -= colors.mean(axis=(0, 2), keepdims=True)
    permuted = [colors[..., list(p)].reshape(5, -1) for p in itertools.permutations(range(3))]
    every = np.concatenate(permuted)
    wanted = np.linalg.svd(every)[1][:6] ** 2 / len(every)
    luma, chroma = split_colors(colors)
    parts = [luma, chroma.reshape(10, 4)]
    found = [largest_first(rows.T @ rows / len(rows))[0] for rows in parts]
    np.testing.assert_allclose(strongest(found, BY_PERMUTATION, 6).variances, wanted, rtol=1e-5)


def test_the_second_color_may_be_left_out():
    chosen = strongest([[2.0], [3.0, 1.0]], BY_PERMUTATION, 4)
    np.testing.assert_array_equal(chosen.part, [1, 1, 0, 1])
    np.testing.assert_array_equal(chosen.component, [0, 0, 0, 1])
    np.testing.assert_allclose(
        chosen.colors @ chosen.colors.T, np.eye(4) + np.eye(4, k=3) + np.eye(4, k=-3), atol=1e-6
    )
    assert len(strongest([[2.0, 1.0]], BY_CHANNEL, 5).variances) == 5
