"""Measured reflectance: one module a file format."""

from nacre.files import Format
from nacre.measured import comma_separated, cornell, merl, rgl
from nacre.measured.merl_table import MerlBrdf
from nacre.measured.rgl import RglBrdf
from nacre.measured.scattered import ScatteredBrdf

FORMATS: tuple[Format, ...] = (
    rgl.FORMAT,
    merl.FORMAT,
    cornell.FORMAT,
    comma_separated.FORMAT,
)
"""Every format of measured reflectance, the most recognisable first."""

__all__ = ["FORMATS", "MerlBrdf", "RglBrdf", "ScatteredBrdf"]
