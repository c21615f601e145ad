"""XML files, read without trust: no document types, so no entities, and no great depth."""

from __future__ import annotations

from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from nacre.errors import FormatError
from nacre.io.files import PathLike, read_bytes

DEPTH_LIMIT = 64  # most elements within each other
_ELEMENT_LIMIT = 1 << 16
_WIDE = b"\xff\xfe", b"\xfe\xff"  # marks of UTF-16


def read_xml(path: PathLike, size_limit: int) -> Element:
    """The root of a file of at most `size_limit` bytes.

    What stands before the first `<` is skipped. Names with a prefix keep it. There are at most
    65,536 elements, so that a large file is text.

    Raises FormatError if the file cannot be read, is not whole XML, is too deep, has too many
    elements, or declares a document type, which is how entities that expand to gigabytes or to
    other files come in.
    """
    data = read_bytes(path, size_limit)
    if not data.startswith(_WIDE):  # tools leave lines of their own before it
        data = data[max(data.find(b"<"), 0) :]
    builder, depth, count = TreeBuilder(), 0, 0
    parser = expat.ParserCreate()
    parser.buffer_text = True

    def doctype(*_: object) -> None:
        raise FormatError(f"{path}: declares a document type (DOCTYPE), which is not read; drop it")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        where = f"{path}: line {parser.CurrentLineNumber}"
        if depth > DEPTH_LIMIT:
            raise FormatError(f"{where}: more than {DEPTH_LIMIT} elements within each other")
        if count > _ELEMENT_LIMIT:
            raise FormatError(f"{where}: more than {_ELEMENT_LIMIT:,} elements")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    parser.StartDoctypeDeclHandler = doctype
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{path}: is not whole XML: {error}") from error
    return builder.close()
