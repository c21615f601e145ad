"""Textures as rectified photographs and a list of their directions, as laboratories have them.

The list is one of pairs of directions (:mod:`nacre.measured.textures.direction_list`) with a
further column `file`, a path from the folder of the list; and, if wanted, `quantity`, what the
pixels of the image hold: `reflectance` or `radiance` (see
:data:`nacre.measured.textures.image_folder.Quantity`), and `scale`, what the value 1 of a pixel
stands for: 4 where the exposure was a quarter, so that highlights of up to four times white are not
cut off.
"""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

from nacre.errors import FormatError
from nacre.io.files import PathLike
from nacre.io.format import Format
from nacre.measured.textures.direction_list import cell_number, read_rows, row_pairs
from nacre.measured.textures.image_folder import QUANTITIES, ImageFolderBtf, Quantity

LIST = "directions.csv"  # name of the list within a folder of photographs
_LARGEST_SCALE = 1e4


def load_photographs(
    folder: PathLike, directions: PathLike | None = None, quantity: Quantity | None = None
) -> ImageFolderBtf:
    """Read a folder of photographs, whose name becomes the material's.

    Images are OpenEXR, PNG or JPEG, see :class:`ImageFolderBtf`. The list is :data:`LIST` in the
    folder unless `directions` names another. `quantity` says what pixels hold, where the list does
    not; "reflectance" where None.

    A FormatError says that the list cannot be read, a column is missing, unknown or there twice, a
    value is not a finite number, a direction is not of unit length or lies below the horizon, a
    pair of them appears twice, both the list and `quantity` say what pixels hold, or an image is
    bad.
    """
    folder = Path(folder)
    path = Path(directions) if directions is not None else folder / LIST
    rows = read_rows(path, images=True)
    if "quantity" in rows[0][1] and quantity is not None:
        raise FormatError(f"{path}: column quantity says what pixels hold; do not state it again")
    wi, wo = row_pairs(path, rows)
    return ImageFolderBtf(
        [_image(path, folder, line, row["file"]) for line, row in rows],
        wi,
        wo,
        folder.resolve().name,
        [_quantity(path, n, row.get("quantity", quantity or QUANTITIES[0])) for n, row in rows],
        [_scale(path, line, row) for line, row in rows],
    )


def _image(path: Path, folder: Path, line: int, name: str) -> Path:
    """Path of an image that is there; it must not leave the folder."""
    where = f"{path}: line {line}: file {name[:80]!r}"
    relative = PurePosixPath(name.replace("\\", "/"))
    if not name or "\0" in name or relative.is_absolute() or ".." in relative.parts:
        raise FormatError(f"{where} is not a path within the folder")
    if not (folder / relative).is_file():
        raise FormatError(f"{where} is not in {folder}")
    return folder / relative


def _quantity(path: Path, line: int, cell: str) -> Quantity:
    for quantity in QUANTITIES:
        if cell == quantity:
            return quantity
    expected = " or ".join(QUANTITIES)
    raise FormatError(f"{path}: line {line}: quantity {cell[:40]!r}, expected {expected}")


def _scale(path: Path, line: int, row: dict[str, str]) -> float:
    if "scale" not in row:
        return 1.0
    scale, most = cell_number(path, line, row, "scale"), _LARGEST_SCALE
    if not 0.0 < scale <= most:
        problem = f"{scale:g} is not above 0 and at most {most:g}"
        raise FormatError(f"{path}: line {line}: column scale: {problem}")
    return scale


def _load(
    path: PathLike, quantity: Quantity | None = None, directions: PathLike | None = None
) -> ImageFolderBtf:
    """A folder with a list, or the list, beside which the images are."""
    path = Path(path)
    folder, listed = (path, directions) if path.is_dir() else (path.parent, path)
    return load_photographs(folder, listed, quantity)


def _recognize(head: bytes) -> bool:
    """Whether the first line that is no remark names a column `file` among others."""
    lines = head.removeprefix(b"\xef\xbb\xbf").lower().splitlines()
    named = next((line for line in lines if line.strip() and not line.startswith(b"#")), b"")
    columns = [cell.strip(b' "') for cell in re.split(b"[,;\t]", named)]
    return b"file" in columns and len(columns) > 1


FORMAT = Format(
    "photographs",
    (".csv",),
    _recognize,
    _load,
    kind="btf",
    claims_folder=lambda path: (path / LIST).is_file(),
)
