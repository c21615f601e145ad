"""Materials from readings: found again, with intervals, and what to read next."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.instruments.names import find_quantity
from nacre.instruments.quantities import GlossQuantity, Quantity
from nacre.instruments.readings import COMMON, Reading, known_quantities
from nacre.latent import pretrained_basis
from nacre.measuring.estimated import estimate_from_readings
from nacre.measuring.from_readings import Expected, posterior_of_readings
from nacre.measuring.predictions import predict
from nacre.numerics.direction_samples import DirectionSamples

BASIS = pretrained_basis()
CODE = BASIS.examples[BASIS.metadata["materials"].index("satin_blue_rgb")].astype(float)
MATERIAL = BASIS.decode(CODE, "satin")


@pytest.mark.parametrize("quantity", known_quantities(COMMON))
def test_expectations_are_readings_and_derivatives_differences(quantity: Quantity):
    expected = Expected.known(BASIS, quantity)
    reading = Reading.of(MATERIAL, quantity)
    logarithm, slopes = expected.at(CODE)
    np.testing.assert_allclose(expected.logarithm(reading.seen), logarithm, atol=2e-3)
    np.testing.assert_allclose(expected.of(CODE), logarithm)
    np.testing.assert_allclose(expected.seen(logarithm), reading.seen, rtol=2e-3)
    for index in range(0, BASIS.code_dim, 7):
        step = 0.02 * np.eye(BASIS.code_dim)[index]
        difference = (expected.of(CODE + step) - expected.of(CODE - step)) / 0.04
        np.testing.assert_allclose(slopes[index], difference, rtol=0.02, atol=2e-3)


@pytest.mark.slow
def test_readings_of_a_material_are_found_again():
    readings = [Reading.of(MATERIAL, quantity) for quantity in known_quantities(COMMON)]
    found = estimate_from_readings(readings, name="again")
    assert found.doubtful == []
    assert found.unexplained < 0.03
    for reading, prediction in zip(readings, found.predictions(), strict=True):
        assert prediction.quantity == reading.quantity
        off = np.abs(np.subtract(prediction.expected, reading.values))
        assert (off < 4.0 + 0.1 * np.abs(reading.values)).all()
        assert prediction.low[0] <= reading.values[0] <= prediction.high[0]
        assert prediction.factor >= 1.0
    assert found.propose() == (pytest.approx(found.propose()[0]), [])  # nothing is left to read
    assert set(found.known_within()) == {
        *("near the mirror direction", "beyond 70 degrees", "elsewhere")
    }


@pytest.mark.slow
def test_readings_narrow_down_what_is_left_open():
    words = [("gloss", "60"), ("sphere", "SCI"), ("multiangle", "45as15"), ("gloss", "20")]
    readings = [Reading.of(MATERIAL, find_quantity(*each)) for each in words]
    few, more = (estimate_from_readings(part) for part in (readings[:1], readings))
    haze = find_quantity("haze")
    of_few, of_more = (
        predict(BASIS, found.posterior.code, found.estimate.codes, haze) for found in (few, more)
    )
    assert of_more.factor < of_few.factor
    error, proposals = few.propose(2)
    assert len(proposals) == 2
    assert error > proposals[0].error > proposals[1].error > 0.0
    assert proposals[0].prediction.quantity.components == ("L*", "a*", "b*")  # gloss has no color
    assert more.propose(0)[0] < error


@pytest.mark.slow
def test_a_reading_that_no_material_explains_is_doubted():
    words = [("gloss", "20"), ("gloss", "60"), ("sphere", "SCI"), ("multiangle", "45as45")]
    readings = [Reading.of(MATERIAL, find_quantity(*each)) for each in words]
    assert estimate_from_readings(readings).doubtful == []
    wrong = Reading(GlossQuantity(20.0), (1500.0,), 0.5)
    found = estimate_from_readings([wrong, *readings[1:]])
    assert found.doubtful == [wrong]


def test_f_r_is_read_as_a_sample_is():
    """A reading at one pair of directions says what the same sample says."""
    quantity = find_quantity("f_r", "45 0 30 180")
    reading = Reading.of(MATERIAL, quantity)
    found = posterior_of_readings(BASIS, [reading])
    pairs = quantity.pairs()
    rgb = np.array([reading.values], np.float32)
    sigma = np.array([reading.uncertainty], np.float32)
    wi, wo = (w.astype(np.float32) for w in (pairs.wi, pairs.wo))
    same = BASIS.posterior(DirectionSamples(wi, wo, rgb, sigma))
    np.testing.assert_allclose(found.code, same.code, atol=2e-2)


def test_no_reading_is_refused():
    with pytest.raises(NacreError, match="one reading or more"):
        estimate_from_readings([])
