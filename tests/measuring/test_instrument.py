"""What an instrument reaches."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.measuring import Instrument


def degrees(cosine):
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def angles(instrument: Instrument):
    """Polar angles of light and detector, the angle between, and between the azimuths."""
    found = instrument.exposures()
    wi, wo = found.wi.astype(float), found.wo.astype(float)
    turn = np.degrees(np.arctan2(wo[..., 1], wo[..., 0]))
    return *(degrees(w[..., 2]) for w in (wi, wo)), degrees((wi * wo).sum(axis=-1)), turn


def test_the_limits_hold():
    light, view, between, _ = angles(Instrument(max_polar=60.0, min_angle=25.0))
    assert max(light.max(), view.max()) <= 60.001
    assert between.min() >= 24.99
    assert len(light) > 200
    assert view.max() > 55.0


def test_the_mirror_direction_is_reached_as_closely_as_the_detector_lets_it():
    light, view, between, turn = angles(Instrument(min_angle=14.0))
    mirror = (np.abs(light - view) < 1e-3) & (np.abs(np.abs(turn) - 180.0) < 1e-3)
    assert between[mirror].min() == pytest.approx(14.0, abs=1e-2)


def test_a_fixed_light_and_a_plane():
    light, view, _, turn = angles(Instrument(fixed_light=35.0, in_plane=True))
    np.testing.assert_allclose(light, 35.0, atol=1e-3)
    inclined = view > 0.01
    assert np.isin(np.round(np.abs(turn[inclined]), 2), (0.0, 180.0)).all()


def test_angles_are_multiples_of_the_step():
    for angle in angles(Instrument(step=2.5))[:2]:
        steps = angle / 2.5
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-3)


def test_a_picture_covers_its_field_of_view():
    found = Instrument(field=(12.0, 8.0)).exposures()
    assert found.pairs == 9
    wo = found.wo.astype(float)
    np.testing.assert_allclose(np.linalg.norm(wo, axis=-1), 1.0, atol=1e-6)
    edges = degrees((wo[:, 3] * wo[:, 5]).sum(-1)), degrees((wo[:, 1] * wo[:, 7]).sum(-1))
    for edge, expected in zip(edges, (12.0, 8.0), strict=True):
        np.testing.assert_allclose(edge, expected, atol=0.01)
    assert (found.wi == found.wi[:, :1]).all()


def test_pairs_differ():
    found = Instrument().exposures()
    pairs = np.concatenate([found.wi, found.wo], axis=-1)[:, 0].round(5)
    assert len(np.unique(pairs, axis=0)) == len(found)


def test_bad_instruments_are_refused():
    for bad in ({"max_polar": 95.0}, {"fixed_light": 85.0}, {"step": 0.0}, {"field": (0.0, 3.0)}):
        with pytest.raises(ValueError, match=r"must be in|beyond"):
            Instrument(**bad)
    with pytest.raises(NacreError, match="reaches no pair"):
        Instrument(max_polar=20.0, fixed_light=0.0, min_angle=35.0).exposures()
