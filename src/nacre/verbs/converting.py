"""`nacre.convert`: a material in another format."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from nacre.btf import Btf
from nacre.io.files import PathLike, check_not_inputs
from nacre.runtime.progress import Progress, silent
from nacre.verbs.material import Given, opened, path_of
from nacre.workflows.conversion import Converted, convert_brdf, convert_btf

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


def convert(
    source: Given,
    output: PathLike,
    *,
    material: str | None = None,
    resolution: Sequence[int] | None = None,
    physical: bool = False,
    precision: str | None = None,
    components: int | None = None,
    pixels: Quantity | None = None,
    progress: Progress | None = None,
) -> Converted:
    """Write a material in another format; its ending chooses which.

    Any reflectance can become a table (`.bsdf`, `.binary`, `.csv`, ...), any texture an archive
    (`.npz`) or a factored file (`.btf`). Neural and analytic formats accept only neural and
    analytic materials: use :func:`nacre.fit` for a table.

    Parameters
    ----------
    source
        A material, its path or name.
    output
        File to write; replaced if it is there.
    material
        Name of the material in a file that holds several.
    resolution
        Numbers of nodes of a table, such as (90, 90, 180) for `.binary`.
    physical
        Make a reflectance reciprocal, and darken views that would reflect more light than they
        receive.
    precision, components
        Of a texture: "single" or "half" in `.npz`; components per channel in `.btf`.
    pixels
        Meaning of the pixels in a folder of images; see :func:`nacre.load`.
    progress
        Called while a texture is written.

    Returns
    -------
    Converted
        The path, and what the format has lost.

    Raises
    ------
    FormatError
        If the source cannot be read, the format cannot hold it, or the path cannot be written.
    TypeError
        If an option is for the other kind of material.
    """
    if (path := path_of(source)) is not None:
        check_not_inputs([output], [path])
    found = opened(source, material=material, quantity=pixels)
    of_texture = {"precision": precision, "components": components}
    of_reflectance = {"resolution": resolution, "physical": physical or None}
    texture = isinstance(found, Btf)
    for name, value in (of_reflectance if texture else of_texture).items():
        if value is not None:
            kinds = ("reflectances", "texture") if texture else ("textures", "reflectance")
            raise TypeError(
                f"{name} is for {kinds[0]}; {found.name or Path(output)} is a {kinds[1]}"
            )
    if isinstance(found, Btf):
        return convert_btf(
            found, output, precision=precision, components=components, progress=progress or silent
        )
    return convert_brdf(found, output, resolution=resolution, physical=physical)
