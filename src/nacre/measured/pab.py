"""Scans of pab-opto goniophotometers as text: a file for each direction of the light.

Lines with a ``#`` say where the light is and what the values are; then each line has the polar
angle and the azimuth of the viewer in degrees and the value, or X, Y and Z. The layout, the
orientation and the symmetry that directions of the light stand for are those of Radiance's
pabopto2bsdf and its manual page.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.color import xyz_to_rgb
from nacre.errors import FormatError, in_words
from nacre.geometry import from_spherical, join
from nacre.io.files import PathLike
from nacre.io.format import Format
from nacre.io.head import recognized_head
from nacre.io.text_file import parse_numbers, read_lines
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf

_SIZE_LIMIT = 1 << 28
_FILE_LIMIT = 10_000
_ENDINGS = (".txt", ".dat", ".brdf", ".bsdf")
_VALUES = {"bsdf", "brdf", "btdf", "dsf"}
_QUADRANT = {(False, False): 1, (True, False): 2, (True, True): 3, (False, True): 4}


@dataclass(eq=False)
class _Slice:
    """One file: the light's polar angle and azimuth in radians, views (n, 2), values (n, 1|3)."""

    path: Path
    sample: str
    light: tuple[float, float]
    views: Floats
    values: Floats

    @property
    def kinds(self) -> set[str]:
        """What the file holds: reflection or transmission, from the front or the back."""
        side = "front" if self.light[0] < np.pi / 2 else "back"
        same = (self.views[:, 0] < np.pi / 2) == (side == "front")
        found = {f"reflection of the {side}"} if same.any() else set()
        return found | ({f"transmission from the {side}"} if not same.all() else set())


def load(path: PathLike) -> ScatteredBrdf:
    """Read one file, or all those of one sample in a folder, as a scan of the front's reflection.

    Light from one azimuth is taken for an isotropic sample; from azimuths within a quarter or half
    of a turn, for a sample that mirrors in the planes which bound these. A FormatError says that a
    file cannot be read or which line is wrong, or that files are of several samples or hold no
    such reflection.
    """
    path = Path(path)
    slices = [_read(file) for file in (_files(path) if path.is_dir() else [path])]
    names = sorted({each.sample for each in slices})
    if len(names) > 1:
        listed = in_words([repr(name[:40]) for name in names[:5]])
        raise FormatError(
            f"{path}: samples {listed}; put the files of each into a folder of its own"
        )
    held = sorted(set().union(*(each.kinds for each in slices)) - {"reflection of the front"})
    front = [each for each in slices if "reflection of the front" in each.kinds]
    if not front:
        raise FormatError(f"{path}: holds no reflection of the front, but {in_words(held)}")
    notes = []
    if held:
        notes.append(f"The files also hold {in_words(held)}; only the front's reflection is read.")
    turns = np.array([each.light[1] for each in front if each.light[0] > 1e-6])
    isotropic = len(np.unique(np.round(np.degrees(turns) % 360.0, 3) % 360.0)) <= 1
    wi = np.concatenate([np.broadcast_to(_vector(*each.light), (len(each.views), 3))
                         for each in front])  # fmt: skip
    wo = np.concatenate([_vector(*each.views.T) for each in front])
    rgb = np.concatenate([_rgb(each.values) for each in front])
    if not isotropic and (axes := _mirrors(turns)):
        symmetry = "quadrilateral" if len(axes) == 2 else "bilateral"
        notes.append(f"Azimuths of the light cover part of a turn: the symmetry is {symmetry}.")
        for axis in axes:
            sign = np.where(np.arange(3) == axis, -1.0, 1.0)
            wi, wo = np.concatenate([wi, wi * sign]), np.concatenate([wo, wo * sign])
            rgb = np.concatenate([rgb, rgb])
    return from_measurement(
        wi,
        wo,
        rgb,
        names[0] or path.stem,
        where=f"{path}: samples",
        isotropic=isotropic,
        notes=notes,
    )


def _files(folder: Path) -> list[Path]:
    files = sorted(file for file in folder.iterdir() if _is_data(file))
    if not files:
        raise FormatError(f"{folder}: is a directory without files of a scan ({_ENDINGS[0]})")
    if len(files) > _FILE_LIMIT:
        raise FormatError(f"{folder}: holds {len(files):,} files, expected up to {_FILE_LIMIT:,}")
    return files


def _is_data(path: Path) -> bool:
    return path.is_file() and path.suffix.lower() in _ENDINGS and not path.name.startswith(".")


def _read(path: Path) -> _Slice:
    header: dict[str, str] = {}
    rows = array("d")
    width = 0
    for number, line in read_lines(path, _SIZE_LIMIT):
        words = line.split()
        if not words:
            continue
        if words[0].startswith("#"):
            key, _, value = line.strip().lstrip("#").strip().replace("\t", " ").partition(" ")
            header.setdefault(key.rstrip(":").lower(), value.strip())
            continue
        width = width or _width(path, header)
        values = parse_numbers(words, f"{path}: line {number}")
        if len(values) != width:
            raise FormatError(f"{path}: line {number}: {len(values)} numbers, expected {width}")
        rows.extend(values)
    if not rows:
        raise FormatError(f"{path}: holds no samples")
    table = np.frombuffer(rows, np.float64).reshape(-1, width)
    up = _angles(path, header, "upphi", 1)[0] if "upphi" in header else 0.0
    polar, azimuth = _light(path, header)
    # Radiance's frame, whose y axis points up.
    views = np.radians(np.stack([table[:, 0], table[:, 1] + 90.0 - up], axis=1))
    if not 0.0 <= polar <= 180.0 or table[:, 0].min() < 0.0 or table[:, 0].max() > 180.0:
        raise FormatError(f"{path}: polar angles: must lie from 0 to 180 degrees")
    values_ = table[:, 2:]
    if header["format"].lower().split()[-1] == "dsf":  # has the cosine
        values_ = values_ / np.maximum(np.abs(np.cos(views[:, :1])), 1e-6)
    if not (np.abs(values_) <= np.finfo(np.float32).max).all():
        raise FormatError(f"{path}: a value is too large")
    sample = header.get("sample_name", "").strip().strip('"')
    return _Slice(
        path, sample, (np.radians(polar), np.radians(azimuth + 90.0 - up)), views, values_
    )


def _width(path: Path, header: dict[str, str]) -> int:
    """Numbers of a line."""
    words = header.get("format", "").lower().split()
    if words[:2] != ["theta", "phi"] or len(words) != 3 or words[2] not in _VALUES:
        problem = "is missing" if not words else f"is {' '.join(words)[:40]!r}"
        raise FormatError(f"{path}: #format: {problem}, expected theta phi DSF, or BSDF")
    colorimetry = header.get("colorimetry", "CIE-Y").strip().upper()
    if colorimetry not in ("CIE-Y", "CIE-XYZ"):
        raise FormatError(
            f"{path}: #colorimetry: is {colorimetry[:40]!r}, expected CIE-Y or CIE-XYZ"
        )
    return 3 if colorimetry == "CIE-Y" else 5


def _light(path: Path, header: dict[str, str]) -> tuple[float, float]:
    """Polar angle and azimuth of the light in degrees."""
    if "intheta" in header and "inphi" in header:
        return _angles(path, header, "intheta", 1)[0], _angles(path, header, "inphi", 1)[0]
    if "incident_angle" in header:
        polar, azimuth = _angles(path, header, "incident_angle", 2)
        return polar, azimuth
    raise FormatError(f"{path}: has no line #incident_angle, nor #intheta and #inphi")


def _angles(path: Path, header: dict[str, str], name: str, count: int) -> list[float]:
    values = parse_numbers(header[name].split()[:count], f"{path}: #{name}")
    if len(values) != count:
        raise FormatError(f"{path}: #{name}: has {len(values)} numbers, expected {count}")
    return values


def _mirrors(turns: Floats) -> list[int]:
    """Axes, 0 or 1, whose sign mirrors what was measured into the other quadrants, by the azimuths
    of lights in radians; none where these have no symmetry.
    """
    x, y = np.cos(turns), np.sin(turns)
    inside = np.minimum(np.abs(x), np.abs(y)) > 1e-6
    quadrants = {_QUADRANT[bool(a < 0.0), bool(b < 0.0)] for a, b in zip(x[inside], y[inside],
                                                                       strict=True)}  # fmt: skip
    if len(quadrants) == 1:
        return [0, 1]
    if quadrants in ({1, 2}, {3, 4}):
        return [1]
    return [0] if quadrants in ({1, 4}, {2, 3}) else []


def _vector(theta: Floats | float, phi: Floats | float) -> Floats:
    return np.asarray(join(from_spherical(np.asarray(theta), np.asarray(phi))))


def _rgb(values: Floats) -> Floats:
    return xyz_to_rgb(values) if values.shape[1] == 3 else np.repeat(values, 3, axis=1)


def _recognize(head: bytes) -> bool:
    text = head.lower()
    return b"#" in text and any(
        line.strip().lstrip(b"#").split()[:3] == [b"format:", b"theta", b"phi"]
        for line in text.splitlines()
        if line.lstrip().startswith(b"#")
    )


def _claims(path: Path) -> bool:
    try:
        return _recognize(recognized_head(path))
    except FormatError:
        return False


def _claims_folder(path: Path) -> bool:
    try:
        files = [file for file in path.iterdir() if _is_data(file)]
    except OSError:
        return False
    return bool(files) and all(_claims(file) for file in files[:_FILE_LIMIT])


FORMAT = Format(
    "pab-opto scan",
    (".txt",),
    _recognize,
    load,
    claims=_claims,  # any text ends in .txt
    claims_folder=_claims_folder,
)
