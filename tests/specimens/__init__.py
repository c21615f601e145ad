"""Small whole files of every format, and ways to break each.

The tests of bad input and the fuzz targets go through :data:`SPECIMENS`: a new reader is covered
by an entry in a module here. Nothing is a real measurement.
"""

from nacre.btf import ubo2014
from nacre.files import Format
from nacre.formats import formats
from tests.specimens import analytic, images, networks, rgl, scans, tables, textures
from tests.specimens.specimen import Specimen, mutated

SPECIMENS: dict[str, Specimen] = {
    **networks.SPECIMENS,
    **rgl.SPECIMENS,
    **tables.SPECIMENS,
    **scans.SPECIMENS,
    **images.SPECIMENS,
    **analytic.SPECIMENS,
    **textures.SPECIMENS,
}
"""One entry for every format, by its name."""

TEXTURES: tuple[Format, ...] = (ubo2014.FORMAT,)
"""Formats of textures, which the registry of reflectance does not list."""


def every_format() -> tuple[Format, ...]:
    """Those of reflectance and those of textures."""
    return (*formats(), *TEXTURES)


__all__ = ["SPECIMENS", "TEXTURES", "Specimen", "every_format", "mutated"]
