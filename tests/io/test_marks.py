"""Marks in files: readers pass over them, and whatever is changed is seen."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy

from nacre.io.files import atomic_path
from nacre.io.marks import Mark, add_mark, can_be_marked, read_mark
from nacre.io.outputs import written_by


def picture(ending: str) -> bytes:
    pillow = pytest.importorskip("PIL.Image")
    frames = [pillow.fromarray(np.full((4, 5, 3), value, np.uint8)) for value in (0, 99)]
    file, several = io.BytesIO(), ending in ("gif", "webp")
    more = {"save_all": True, "append_images": frames[1:]} if several else {}
    frames[0].save(file, "jpeg" if ending == "jpg" else ending, **more)
    return file.getvalue()


def archive() -> bytes:
    file = io.BytesIO()
    np.savez(file, a=np.arange(4))
    return file.getvalue()


CONTENTS = {
    "x.png": lambda: picture("png"),
    "x.jpg": lambda: picture("jpg"),
    "x.gif": lambda: picture("gif"),
    "x.webp": lambda: picture("webp"),
    "x.npz": archive,
    "x.safetensors": lambda: safetensors.numpy.save({"a": np.arange(3)}, {"nacre": "{}"}),
    "x.json": lambda: b'{\n "model": "ggx"\n}\n',
    "x.html": lambda: b"<!doctype html>\n<p>gold</p>\n",
    "x.glsl": lambda: b"float x;\n",
    "x.py": lambda: b"x = 1\n",
    "x.csv": lambda: b"# name: gold\ntheta,phi\n1,2\n",
    "x.pdf": lambda: b"%PDF-1.4\n%%EOF\n",
    "x.glb": lambda: b"glTF\2\0\0\0\x18\0\0\0\4\0\0\0JSON{}  ",
    "x.onnx": lambda: b"\x08\x08",
    "x.brdf": lambda: b"analytic\n::begin shader\n::end shader\n",
    "x.bsdf": lambda: b"tensor_file\0" + bytes(9),
}


@pytest.fixture(params=CONTENTS)
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path: Path = tmp_path / request.param
    path.write_bytes(CONTENTS[request.param]())
    return path


def test_a_mark_is_read_back_and_the_same_each_time(path: Path) -> None:
    content = path.read_bytes()
    assert can_be_marked(path) or path.suffix == ".csv"
    assert read_mark(path) is None
    add_mark(path, "nacre btf map")
    assert read_mark(path) == Mark("nacre btf map", True)
    marked = path.read_bytes()
    assert len(marked) < len(content) + 100
    path.write_bytes(content)
    add_mark(path, "nacre btf map")
    assert path.read_bytes() == marked


def test_every_change_is_seen(path: Path) -> None:
    add_mark(path, "nacre fit")
    content = path.read_bytes()
    for place in range(0, len(content), max(1, len(content) // 40)):
        path.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
        assert read_mark(path) != Mark("nacre fit", True)
    for changed in (content + b"\n", content[:-1]):
        path.write_bytes(changed)
        assert read_mark(path) != Mark("nacre fit", True)


def test_readers_pass_over_marks(tmp_path: Path) -> None:
    pillow = pytest.importorskip("PIL.Image")
    for name, make in CONTENTS.items():
        (tmp_path / name).write_bytes(make())
        add_mark(tmp_path / name, "nacre fit")
    for ending in ("png", "jpg", "gif", "webp"):
        with pillow.open(tmp_path / f"x.{ending}") as image:
            image.load()
            assert image.size == (5, 4)
            if ending in ("gif", "webp"):
                image.seek(1)
                image.load()
    with pillow.open(tmp_path / "x.png") as image:
        assert image.text["Software"].startswith("nacre fit ")
    np.testing.assert_array_equal(np.load(tmp_path / "x.npz")["a"], np.arange(4))
    assert zipfile.ZipFile(tmp_path / "x.npz").comment.startswith(b"nacre fit ")
    tensors = safetensors.numpy.load((tmp_path / "x.safetensors").read_bytes())
    np.testing.assert_array_equal(tensors["a"], np.arange(3))
    glb = (tmp_path / "x.glb").read_bytes()
    assert int.from_bytes(glb[8:12], "little") == len(glb)


@pytest.mark.parametrize(
    ("name", "content"),
    [("x.binary", b"1"), ("x.csv", b"a,b\n"), ("x.brdf", b"FILE"), ("x.json", b"[1]"),
     ("x.safetensors", b""), ("x.png", b"no picture"), ("x.json", b"{}")],
)  # fmt: skip
def test_what_has_no_place_for_a_mark_stays_as_it_is(
    tmp_path: Path, name: str, content: bytes
) -> None:
    path = tmp_path / name
    with written_by("nacre fit"), atomic_path(path) as temporary:
        temporary.write_bytes(content)
    assert path.read_bytes() == content
    assert read_mark(path) is None


def test_a_program_of_another_name_is_called_nacre(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    path.write_text("text\n")
    add_mark(path, "My Program")
    assert read_mark(path) == Mark("nacre", True)
