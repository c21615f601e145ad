"""Exports of the RT-300S and Reflet goniometers, which are refused by what they hold."""

from __future__ import annotations

import re
from typing import NoReturn

from nacre.errors import FormatError
from nacre.io.files import PathLike
from nacre.io.format import Format


def load(path: PathLike) -> NoReturn:
    """Raise a FormatError: blocks of raw signals are no reflectance."""
    problem = "holds raw signals of an RT-300S or Reflet goniometer, not reflectance"
    fix = "convert it to f_r first, for example with bsdf-tools, and give the Zemax or FRED file"
    raise FormatError(f"{path}: {problem}; {fix}")


def _recognize(head: bytes) -> bool:
    return b"RT-300S)" in head or re.search(rb"Calibration.*Reflet", head, re.DOTALL) is not None


FORMAT = Format("RT-300S export", (".jdv",), _recognize, load)
