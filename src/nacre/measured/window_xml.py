"""The XML of LBNL's WINDOW 6, as far as Radiance reads it."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.parsers import expat

from nacre.errors import FormatError
from nacre.io.files import PathLike, read_bytes

_SIZE_LIMIT = 1 << 28
_DEPTH_LIMIT = 32
_NAME_LIMIT = 200

_LAYER = ("WindowElement", "Optical", "Layer")
_DATA = (*_LAYER, "WavelengthData")
_BLOCK = (*_DATA, "WavelengthDataBlock")


@dataclass
class Block:
    wavelength: str  # "Visible", "CIE-u" and so on
    direction: str = ""  # "Reflection Back" and so on
    basis: str = ""  # angle basis
    data: str = ""


@dataclass
class Layer:
    """The first layer of a file."""

    name: str = ""
    manufacturer: str = ""
    structure: str = ""  # "TensorTree3" and so on
    blocks: list[Block] = field(default_factory=list)


_FIELDS = {
    (*_LAYER, "Material", "Name"): "name",
    (*_LAYER, "Material", "Manufacturer"): "manufacturer",
    (*_LAYER, "DataDefinition", "IncidentDataStructure"): "structure",
    (*_DATA, "Wavelength"): "wavelength",
    (*_BLOCK, "WavelengthDataDirection"): "direction",
    (*_BLOCK, "AngleBasis"): "basis",
    (*_BLOCK, "ScatteringData"): "data",
}


class _Reader:
    def __init__(self) -> None:
        self.layer = Layer()
        self._path: list[str] = []
        self._text: list[str] = []
        self._layers = 0
        self._wavelength = ""

    def open(self, name: str, _: object) -> None:
        if len(self._path) >= _DEPTH_LIMIT:
            raise ValueError(f"elements lie within more than {_DEPTH_LIMIT} others")
        self._path.append(name)
        self._text.clear()
        path = tuple(self._path)
        self._layers += path == _LAYER
        if path == _DATA:
            self._wavelength = ""
        elif path == _BLOCK and self._layers == 1:
            self.layer.blocks.append(Block(self._wavelength))

    def take(self, text: str) -> None:
        if tuple(self._path) in _FIELDS:
            self._text.append(text)

    def close(self, _: str) -> None:
        key = _FIELDS.get(tuple(self._path))
        self._path.pop()
        if key is None or self._layers != 1:
            return
        text = "".join(self._text).strip()
        self._text.clear()
        if key == "wavelength":
            self._wavelength = text
        elif key in ("name", "manufacturer", "structure"):
            setattr(self.layer, key, text[:_NAME_LIMIT])
        else:
            setattr(self.layer.blocks[-1], key, text)


def read_layer(path: PathLike) -> Layer:
    """The first layer of an XML file.

    A FormatError says that the file cannot be read, is not XML, has no layer, or has a document
    type, which could make a short file long.
    """
    data = read_bytes(path, _SIZE_LIMIT)
    reader = _Reader()
    parser = expat.ParserCreate()
    parser.buffer_text = True

    def refuse(*_: object) -> None:
        raise ValueError("has a document type, which these files do not")

    parser.StartElementHandler, parser.EndElementHandler = reader.open, reader.close
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = reader.take, refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise FormatError(f"{path}: is not whole XML: {error}") from error
    except ValueError as error:
        raise FormatError(f"{path}: {error}") from error
    if not reader.layer.structure and not reader.layer.blocks:
        raise FormatError(f"{path}: has no layer of WINDOW 6")
    return reader.layer
