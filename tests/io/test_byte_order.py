"""Binary files are read the same on any machine: no reader takes the order of bytes from its own.

No machine with the other order is here to try it on, so the sources are looked at.
"""

from __future__ import annotations

import ast
import struct
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError

PACKAGE = Path(nacre.__file__).parent
LAYOUTS = {
    "pack",
    "pack_into",
    "unpack",
    "unpack_from",
    "iter_unpack",
    "calcsize",
    "Struct",
    "take",
}
ARRAYS = {"frombuffer": 1, "fromfile": 1, "memmap": 1}
"""Functions of NumPy that read bytes, and the place of the type among their arguments."""
ONE_BYTE = {"np.uint8", "np.int8"}
OWN_MEMORY = {
    "measured/cornell.py": "an array of floats",
    "measured/fred.py": "an array of floats",
    "measured/goniometer/reader.py": "an array of floats",
    "measured/pab.py": "an array of floats",
    "measured/sample_columns.py": "an array of floats",
    "measured/tensor_tree.py": "an array of floats",
    "measured/tracepro.py": "an array of floats",
    "measured/textures/transposition.py": "a temporary file of this process",
    "textures/capture/gonioreflectometer.py": "a temporary file of this process",
}
"""Modules that look at bytes which this process has made, and what they are."""
STATED = {
    ("io/npy.py", "dtype"): "from the header of the file, which states the order",
    ("measured/raw.py", "lengths[len(data)]"): "names that callers give, see below",
    ("measured/tensor_file.py", "dtype"): "of a table of types that state the order",
    ("measured/textures/ubo2014/reader.py", "whole"): "of factors whose type states the order",
    ("measured/textures/ubo2014/header.py", "layout"): "a structure whose parts state the order",
    ("workflows/encoded_blocks.py", "self._stored"): "made little-endian",
}
"""Types that are variables, and where they come from."""


def _text(node: ast.expr) -> str | None:
    """A text, or what an f-string begins with, which may be nothing."""
    if isinstance(node, ast.JoinedStr):
        return (node.values and _text(node.values[0])) or ""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def _constants(tree: ast.Module) -> dict[str, str]:
    """Types that a module names at its top: `NAME = np.dtype("<f2")`."""
    found = {}
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and node.value.args:
            found[ast.unparse(node.targets[0])] = _text(node.value.args[0]) or ""
    return found


def native(path: Path, name: str) -> list[str]:
    """Calls in a source that read or write numbers in the order of the machine."""
    source = path.read_text("utf-8")
    if not any(word in source for word in ("struct.", ".take(", *ARRAYS)):
        return []
    found, tree = [], ast.parse(source)
    named = _constants(tree)
    for call in ast.walk(tree):
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute)):
            continue
        function = call.func.attr
        if function == "take" and len(call.args) != 2:  # of a reader of words
            continue
        layout = _text(call.args[0]) if function in LAYOUTS and call.args else None
        if layout is not None and layout[:1] not in tuple("<>!"):
            found.append(ast.unparse(call))
        if (
            function in ARRAYS
            and ast.unparse(call.func).startswith("np.")
            and name not in OWN_MEMORY
        ):
            given = [k.value for k in call.keywords if k.arg == "dtype"]
            given += call.args[ARRAYS[function] :][:1]
            kind = ast.unparse(given[0]) if given else ""
            text = _text(given[0]) if given else None
            text = text or named.get(kind, "")
            if text[:1] not in tuple("<>") and kind not in ONE_BYTE and (name, kind) not in STATED:
                found.append(ast.unparse(call))
    return found


def test_no_reader_takes_the_order_of_bytes_from_the_machine():
    found = {
        name: wrong
        for path in sorted(PACKAGE.rglob("*.py"))
        if (wrong := native(path, name := path.relative_to(PACKAGE).as_posix()))
    }
    assert found == {}


def test_what_is_excepted_is_there():
    for name, kind in [*STATED, *((name, "np.") for name in OWN_MEMORY)]:
        assert kind in (PACKAGE / name).read_text("utf-8"), name


@pytest.mark.parametrize(
    "line",
    [
        'struct.unpack("3i", data)',
        'struct.Struct("I")',
        "reader.take('2f', 'what')",
        'struct.unpack_from(f"{n}Q", data)',
        "np.frombuffer(data)",
        "np.frombuffer(data, np.float32)",
        "np.fromfile(path, dtype='f4')",
        'KIND = np.dtype("f2")\nnp.frombuffer(data, KIND)',
    ],
)
def test_what_is_wrong_is_seen(tmp_path: Path, line: str):
    source = tmp_path / "a.py"
    source.write_text(line)
    assert native(source, "a.py")


def test_tables_of_types_state_the_order():
    from nacre.measured import merl, tensor_file

    kinds = [*map(np.dtype, merl._TYPES), *tensor_file._CODES]
    assert all(kind.str[0] in "<|" for kind in kinds)


@pytest.mark.parametrize("ending", ["binary", "mbsdf"])
def test_a_file_of_the_other_order_is_refused(tmp_path: Path, ending: str):
    path = tmp_path / f"a.{ending}"
    head = {"binary": struct.pack(">3i", 90, 90, 180), "mbsdf": b""}[ending]
    path.write_bytes(head + np.ones(3 * 90, ">f8").tobytes())
    with pytest.raises(FormatError, match=path.name):
        nacre.load(path)
