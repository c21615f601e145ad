"""Small whole files of every format in the registries, and ways to break each.

The tests of bad input and the fuzz targets go through :data:`SPECIMENS`: a new reader is covered
by an entry in a module here. Nothing is a real measurement.
"""

from nacre.formats import formats
from nacre.io.format import Format
from tests.specimens import (
    analytic,
    encoded,
    gltf,
    images,
    more_tables,
    networks,
    rgl,
    scans,
    surfaces,
    tables,
    textures,
    tool_tables,
    ubo2014,
)
from tests.specimens.specimen import Specimen, mutated

SPECIMENS: dict[str, Specimen] = {
    **networks.SPECIMENS,
    **rgl.SPECIMENS,
    **tables.SPECIMENS,
    **scans.SPECIMENS,
    **tool_tables.SPECIMENS,
    **more_tables.SPECIMENS,
    **images.SPECIMENS,
    **analytic.SPECIMENS,
    **gltf.SPECIMENS,
    **surfaces.SPECIMENS,
    **textures.SPECIMENS,
    **ubo2014.SPECIMENS,
    **encoded.SPECIMENS,
}
"""One entry for every format of the registries, by its name."""


def file_formats() -> tuple[Format, ...]:
    """Every format but for those of folders only."""
    return tuple(entry for entry in formats() if entry.extensions)


__all__ = ["SPECIMENS", "Specimen", "file_formats", "mutated"]
