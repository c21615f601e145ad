"""Plots over wavelength: lines are the spectra at the directions of their panel."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.figures.spectrum import spectrum_figure
from nacre.geometry import from_spherical, join
from tests.mitsuba.reflectances import Constant
from tests.spectra import BANDS, Coated, scanned, spectral_network

pytest.importorskip("matplotlib", reason="needs the extra 'plot'")

ANGLES = [0.3, 1.0]


def direction(theta, phi):
    return join(from_spherical(np.float64(theta), np.float64(phi)))


@pytest.mark.parametrize("material", [Coated(), spectral_network(), scanned(Coated(), 2000)])
def test_lines_are_spectra_in_the_mirror_direction_and_at_the_normal(material):
    figure = spectrum_figure({"one": material}, ANGLES, azimuth=0.4)
    assert len(figure.axes) == 4
    drawn = 0
    views = [(angle, angle) for angle in ANGLES] + [(angle, 0.0) for angle in ANGLES]
    for axes, (light, view) in zip(figure.axes, views, strict=True):
        wi, wo = direction(light, 0.4 + math.pi), direction(view, 0.4)
        (line,) = axes.lines
        np.testing.assert_array_equal(line.get_xdata(), BANDS)
        if not material.valid(wi, wo):
            assert np.isnan(line.get_ydata()).all()
            continue
        drawn += 1
        np.testing.assert_allclose(line.get_ydata(), material.eval_spectral(wi, wo), rtol=1e-5)
        assert axes.get_ylim()[0] == 0.0
        assert axes.get_ylim()[1] > line.get_ydata().max()
    assert drawn == 4 or (material.scattered() is not None and drawn > 0)


def test_materials_with_other_bands_share_the_panels():
    near = Coated(np.linspace(800.0, 900.0, 5))
    figure = spectrum_figure({"visible": Coated(), "infrared": near}, [0.5])
    for axes in figure.axes:
        assert [len(line.get_xdata()) for line in axes.lines] == [len(BANDS), 5]
        assert axes.get_xlim() == (400.0, 900.0)
        assert [line.get_marker() for line in axes.lines] == ["None", "o"]


def test_a_single_band_is_a_dot():
    (line,) = spectrum_figure({"laser": Coated([633.0])}, [0.5]).axes[0].lines
    assert (line.get_marker(), list(line.get_xdata())) == ("o", [633.0])


def test_what_was_not_measured_is_not_drawn():
    class Half(Coated):
        def valid_components(self, wi, wo):
            return wo[2] > 0.99

    mirror, normal = spectrum_figure({"half": Half()}, [0.5]).axes
    assert not np.isfinite(mirror.lines[0].get_ydata()).any()
    assert [text.get_text() for text in mirror.texts] == ["not measured here"]
    assert np.isfinite(normal.lines[0].get_ydata()).all()
    assert not normal.texts


def test_what_has_no_spectrum_is_refused():
    with pytest.raises(NacreError, match="gray: is known in RGB only"):
        spectrum_figure({"coated": Coated(), "gray": Constant(0.3)})
    with pytest.raises(NacreError, match="1 to 7 materials, not 0"):
        spectrum_figure({})

    class Unknown(Coated):
        def valid_components(self, wi, wo):
            return wi[2] > 2.0

    with pytest.raises(NacreError, match="not known at any of these directions"):
        spectrum_figure({"none": Unknown()})
    with pytest.raises(ValueError, match="at least one angle"):
        spectrum_figure({"coated": Coated()}, [])
