"""Directions and parametrizations: round trips, poles, horizon, both precisions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from nacre import geometry as g

PRECISIONS = {np.float32: 4e-6, np.float64: 1e-13}

angle = st.floats(0.0, math.pi / 2)
azimuth = st.floats(-math.pi, math.pi)


def direction(theta: float, phi: float, dtype: type = np.float64) -> g.Components:
    return tuple(dtype(c) for c in g.from_spherical(theta, phi))


@pytest.mark.parametrize("dtype", PRECISIONS)
@given(angle, azimuth, angle, azimuth)
@example(0.0, 0.0, 0.0, 0.0)  # wi = wo = n
@example(0.7, 0.3, 0.7, 0.3)  # wi = wo
@example(math.pi / 2, 0.0, math.pi / 2, 1.0)  # both at the horizon
@example(1.2, 0.5, 1.2, 0.5 + math.pi)  # mirror pair: h at the pole
@example(1e-6, 0.0, 1e-6, 2.0)
@settings(max_examples=200, deadline=None)
def test_half_difference_and_back_gives_the_same_directions(dtype, ti, pi, to, po):
    wi, wo = direction(ti, pi, dtype), direction(to, po, dtype)
    if np.linalg.norm(np.add(wi, wo)) < 1e-3:
        return  # opposite directions have no half vector
    h, d = g.half_difference(wi, wo)
    back_i, back_o = g.from_half_difference(h, d)
    tolerance = PRECISIONS[dtype] / max(np.linalg.norm(np.add(wi, wo)), 1e-3)
    np.testing.assert_allclose(back_i, wi, atol=tolerance)
    np.testing.assert_allclose(back_o, wo, atol=tolerance)
    np.testing.assert_allclose(np.linalg.norm(h), 1.0, atol=PRECISIONS[dtype])
    np.testing.assert_allclose(np.linalg.norm(d), 1.0, atol=tolerance)
    assert all(np.asarray(c).dtype == dtype for c in (*h, *d))


@given(angle, st.floats(0.0, 2 * math.pi), angle, st.floats(0.0, 2 * math.pi))
@settings(max_examples=200, deadline=None)
def test_rusinkiewicz_angles_round_trip(theta_h, phi_h, theta_d, phi_d):
    pair = g.from_rusinkiewicz_angles(theta_h, phi_h, theta_d, phi_d)
    if theta_d > math.pi / 2 - 1e-6:
        return  # opposite directions have no half vector
    again = g.from_rusinkiewicz_angles(*g.rusinkiewicz_angles(*pair))
    np.testing.assert_allclose(again, pair, atol=1e-8)


def test_half_difference_matches_the_definition_by_rotations():
    random = np.random.default_rng(0)
    wi, wo = random.normal(size=(2, 1000, 3))
    wi, wo = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
    h, d = (g.join(v) for v in g.half_difference(g.split(wi), g.split(wo)))
    theta, phi = g.to_spherical(g.split(h))
    for k in range(1000):
        cp, sp, ct, st_ = np.cos(phi[k]), np.sin(phi[k]), np.cos(theta[k]), np.sin(theta[k])
        about_z = np.array([[cp, sp, 0], [-sp, cp, 0], [0, 0, 1]])
        about_y = np.array([[ct, 0, -st_], [0, 1, 0], [st_, 0, ct]])
        np.testing.assert_allclose(about_y @ about_z @ wi[k], d[k], atol=1e-12)


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_carrying_to_the_pole_is_the_smallest_rotation(dtype):
    random = np.random.default_rng(4)
    w, h = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in random.normal(size=(2, 500, 3)))
    h[:, 2] = np.abs(h[:, 2])
    h[0] = 0.0, 0.0, 1.0
    found = g.carried_to_pole(g.split(w.astype(dtype)), g.split(h.astype(dtype)))
    axis = np.cross(h, [0.0, 0.0, 1.0])  # its length is the sine of the angle
    squared = np.maximum((axis**2).sum(1), 1e-300)
    along = ((axis * w).sum(1) * (1.0 - h[:, 2]) / squared)[:, None]
    expected = h[:, 2:] * w + np.cross(axis, w) + along * axis  # Rodrigues
    np.testing.assert_allclose(g.join(found), expected, atol=PRECISIONS[dtype])
    assert all(c.dtype == dtype for c in found)


def test_the_light_carried_to_the_pole_is_d_turned_by_phi_h():
    random = np.random.default_rng(6)
    wi, wo = g.uniform_rusinkiewicz(random.random((4, 500)))
    h, d = g.half_difference(wi, wo)
    turned = g.rotate(d, np.arctan2(h[1], h[0]))
    np.testing.assert_allclose(g.carried_to_pole(wi, h), turned, atol=1e-12)


def test_difference_angle_is_half_the_angle_between_the_directions():
    wi, wo = direction(0.3, 0.2), direction(0.9, 1.4)
    theta_d = g.rusinkiewicz_angles(wi, wo)[2]
    assert theta_d == pytest.approx(math.acos(g.dot(wi, wo)) / 2)


def test_swapping_the_directions_turns_phi_d_by_half_a_turn():
    wi, wo = direction(0.3, 0.2), direction(0.9, 1.4)
    one, other = g.rusinkiewicz_angles(wi, wo), g.rusinkiewicz_angles(wo, wi)
    np.testing.assert_allclose(one[:3], other[:3], atol=1e-12)
    assert math.cos(one[3] - other[3]) == pytest.approx(-1.0)


@pytest.mark.parametrize("dtype", PRECISIONS)
@given(angle, azimuth)
@settings(max_examples=100, deadline=None)
def test_stereographic_round_trip(dtype, theta, phi):
    w = direction(theta, phi, dtype)
    back = g.from_stereographic(*g.stereographic(w))
    np.testing.assert_allclose(back, w, atol=PRECISIONS[dtype])
    assert np.hypot(*g.stereographic(w)) <= 1 + PRECISIONS[dtype]


@given(angle, azimuth)
@settings(max_examples=100, deadline=None)
def test_spherical_round_trip(theta, phi):
    w = g.from_spherical(theta, phi)
    np.testing.assert_allclose(g.from_spherical(*g.to_spherical(w)), w, atol=1e-14)


def test_isotropic_keeps_the_polar_angle_and_drops_the_azimuth():
    h = direction(0.6, 2.0)
    np.testing.assert_allclose(g.isotropic(h), direction(0.6, 0.0), atol=1e-15)


def test_reflect_about_the_half_vector_swaps_the_directions():
    wi, wo = direction(0.3, 0.2), direction(0.9, 1.4)
    np.testing.assert_allclose(g.reflect(wo, g.half_vector(wi, wo)), wi, atol=1e-15)


def test_opposite_directions_stay_finite():
    wi, wo = direction(math.pi / 2, 0.0), direction(math.pi / 2, math.pi)
    assert np.isfinite(g.half_difference(tuple(wi), tuple(-np.array(wi)))).all()
    assert np.isfinite(g.half_difference(wi, wo)).all()


def test_cosine_hemisphere_has_the_moments_of_a_cosine_density():
    u, v = (np.arange(256) + 0.5)[:, None] / 256, (np.arange(256) + 0.5)[None] / 256
    w = g.join(g.cosine_hemisphere(u, v))
    np.testing.assert_allclose(w[..., 2].mean(), 2 / 3, atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(w, axis=-1), 1.0, atol=1e-12)


def test_wrong_shape_is_refused():
    with pytest.raises(ValueError, match=r"\(\.\.\., 3\)"):
        g.split(np.zeros((3, 4)))


@pytest.mark.parametrize(
    "shapes",
    [
        [(3,), (3,)],
        [(5, 3), (3,)],
        [(4, 1, 3), (5, 3)],
        [(2, 1, 1, 3), (1, 6, 3), (7, 1, 1, 3)[1:]],
        [(0, 3), (1, 3)],
    ],
)
def test_shapes_broadcast_as_those_of_numpy(shapes):
    arrays = {f"a{k}": np.zeros(shape) for k, shape in enumerate(shapes)}
    assert g.broadcast_shape(**arrays) == np.broadcast_shapes(*shapes)


def test_shapes_that_do_not_broadcast_are_named():
    with pytest.raises(ValueError, match=r"do not broadcast: wi \(4, 3\), wo \(5, 3\)"):
        g.broadcast_shape(wi=np.zeros((4, 3)), wo=np.zeros((5, 3)))
    with pytest.raises(ValueError, match=r"expected wo of shape \(\.\.\., 3\), got \(4, 2\)"):
        g.broadcast_shape(wi=np.zeros((4, 3)), wo=np.zeros((4, 2)))


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_a_right_angle_turns_x_to_y(dtype):
    w = g.split(np.array([0.48, 0.6, 0.64], dtype))
    turned = g.rotate(w, math.pi / 2)
    np.testing.assert_allclose(turned, [-0.6, 0.48, 0.64], atol=PRECISIONS[dtype])
    assert {c.dtype for c in turned} == {np.dtype(dtype)}


def test_spherical_angles_are_those_of_the_axes():
    np.testing.assert_allclose(g.from_spherical(math.pi / 2, math.pi / 2), (0, 1, 0), atol=1e-15)
    np.testing.assert_allclose(g.from_spherical(math.pi / 2, 0.0), (1, 0, 0), atol=1e-15)
    assert g.to_spherical((0.0, 3.0, 0.0)) == pytest.approx((math.pi / 2, math.pi / 2))
    assert g.to_spherical((-2.0, 0.0, 2.0)) == pytest.approx((math.pi / 4, math.pi))


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_normalizing_keeps_the_direction_and_the_zero_vector(dtype):
    found = g.join(g.normalize(g.split(np.array([[2, 3, 6], [0, 0, 0], [0, 0, 1e-9]], dtype))))
    np.testing.assert_allclose(found, [[2 / 7, 3 / 7, 6 / 7], [0, 0, 0], [0, 0, 1]], rtol=1e-6)
    assert found.dtype == dtype


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_at_the_pole_the_azimuth_is_0_and_the_sine_is_not(dtype):
    pole = g.split(np.array([[0, 0, 1], [0, 0, -1], [1e-20, 1e-20, 1]], dtype))
    cos_phi, sin_phi, sin_theta = g.azimuth(pole)
    np.testing.assert_array_equal(cos_phi, 1.0)
    np.testing.assert_array_equal(np.abs(sin_phi) < 1e-5, True)
    np.testing.assert_array_equal(sin_theta, 2.0**-49)
    near = g.split(np.array([3e-14, 4e-14, 1.0], dtype))
    assert g.azimuth(near) == pytest.approx((0.6, 0.8, 5e-14), rel=1e-6)


def test_stereographic_coordinates_are_tangents_of_half_the_polar_angle():
    for theta in (0.0, 0.4, math.pi / 2, 2.0):
        x, y = g.stereographic(direction(theta, 0.5))
        assert math.hypot(x, y) == pytest.approx(math.tan(theta / 2))
        assert math.atan2(y, x) == pytest.approx(0.5 if theta else 0.0)


def test_uniform_rusinkiewicz_spreads_the_angles_over_their_ranges():
    u = np.array([0.25, 0.4, 0.75, 0.1])
    angles = g.rusinkiewicz_angles(*g.uniform_rusinkiewicz(u))
    expected = math.pi / 8, 0.8 * math.pi, 3 * math.pi / 8, 0.2 * math.pi
    np.testing.assert_allclose(angles, expected, atol=1e-12)


def test_uniform_hemisphere_has_the_moments_of_a_constant_density():
    u, v = (np.arange(256) + 0.5)[:, None] / 256, (np.arange(256) + 0.5)[None] / 256
    w = g.join(g.uniform_hemisphere(u, v)).reshape(-1, 3)
    np.testing.assert_allclose(w.mean(axis=0), [0.0, 0.0, 0.5], atol=1e-5)
    np.testing.assert_allclose(w.T @ w / len(w), np.eye(3) / 3, atol=1e-5)
    assert (w[:, 2] >= 0).all()


def test_azimuths_of_both_hemispheres_begin_at_x_and_go_to_y():
    quarter = np.array([0.0, 0.25])
    uniform = g.join(g.uniform_hemisphere(np.array([1.0, 1.0]), quarter))
    cosine = g.join(g.cosine_hemisphere(np.array([1.0, 1.0]), quarter))
    for found in uniform, cosine:
        np.testing.assert_allclose(found, [[1, 0, 0], [0, 1, 0]], atol=1e-12)
    half = g.join(g.cosine_hemisphere(np.array([0.36]), np.array([0.5])))
    np.testing.assert_allclose(half, [[-0.6, 0.0, 0.8]], atol=1e-12)
