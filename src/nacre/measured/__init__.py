"""Measured reflectance: one module a file format."""

from nacre.io.format import Format
from nacre.measured import comma_separated, cornell, merl, merl_array, rgl, utia, utia_image
from nacre.measured.merl_table import MerlBrdf
from nacre.measured.rgl import RglBrdf
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.utia_table import UtiaBrdf

FORMATS: tuple[Format, ...] = (
    rgl.FORMAT,
    merl.FORMAT,
    *merl_array.FORMATS,
    *comma_separated.FORMATS,
    cornell.FORMAT,
    utia.FORMAT,
    *utia_image.FORMATS,
)
"""Every format of measured reflectance, the most recognizable first."""

__all__ = ["FORMATS", "MerlBrdf", "RglBrdf", "ScatteredBrdf", "UtiaBrdf"]
