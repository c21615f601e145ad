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
