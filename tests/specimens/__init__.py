"""Small whole files of every format in the registry, and ways to break each.

The tests of bad input and the fuzz targets go through :data:`SPECIMENS`: a new reader is covered
by an entry in a module here. Nothing is a real measurement.
"""

from tests.specimens import analytic, images, networks, rgl, scans, tables
from tests.specimens.specimen import Specimen, mutated

SPECIMENS: dict[str, Specimen] = {
    **networks.SPECIMENS,
    **rgl.SPECIMENS,
    **tables.SPECIMENS,
    **scans.SPECIMENS,
    **images.SPECIMENS,
    **analytic.SPECIMENS,
}
"""One entry for every format of the registry, by its name."""

__all__ = ["SPECIMENS", "Specimen", "mutated"]
