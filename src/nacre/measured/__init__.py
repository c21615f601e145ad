"""Measured reflectance: one module a file format."""

from nacre.files import Format
from nacre.measured import merl, rgl
from nacre.measured.merl_table import MerlBrdf
from nacre.measured.rgl import RglBrdf

FORMATS: tuple[Format, ...] = (rgl.FORMAT, merl.FORMAT)
"""Every format of measured reflectance, the most recognisable first."""

__all__ = ["FORMATS", "MerlBrdf", "RglBrdf"]
