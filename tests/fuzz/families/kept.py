"""What long work keeps and goes on from: states, manifests, journals, notes."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import NoReturn

import numpy as np

from nacre.btf import TableBtf
from nacre.download.fetch import _recorded
from nacre.download.transfer import Transfer
from nacre.latent.descent import descend, free
from nacre.latent.recipes import BasisRecipe
from nacre.runtime.progress import silent
from nacre.runtime.store import Store
from nacre.textures.capture import dataset
from nacre.textures.capture.recipe import built_in
from nacre.textures.codecs.basis.fields import kept, pack_fields
from nacre.textures.codecs.basis.networks import AngularFunctions
from nacre.textures.codecs.codec import CODECS, TrainingRun
from nacre.textures.codecs.networks import CustomSettings, NetworkRecipe, TrainingRecipe
from nacre.textures.codecs.networks.journal import COLUMNS, Journal
from nacre.workflows.encoding import encode
from nacre.workflows.manifest import MANIFEST, Manifest, Record
from tests.fuzz.damage import Rebuild, json_damage, tensors_damage, words_damage
from tests.fuzz.readers import Reader, reader
from tests.specimens.specimen import mutated
from tests.textures.codecs.basis.made import codec
from tests.textures.codecs.networks.made import COARSE, texture


def written(name: str, write: Callable[[Path], object]) -> bytes:
    """What a function writes into a file of a name in a folder of its own."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()


# Trainings in PyTorch of bases, and of networks for textures


def _descend(path: Path) -> float:
    weights = [free(np.ones((2, 3))), free(np.zeros(3))]
    recipe = BasisRecipe(code_dim=2, hidden=(3,), steps=3, directions=4, batch=4)
    return descend(
        {1.0: weights}, lambda _: sum((w * w).sum() for w in weights), recipe, "", path, silent
    )


_TEXTURES = [texture(seed, size=3) for seed in range(2)]
_SETTINGS = CustomSettings(latent=2)
_RECIPE = TrainingRecipe(texels=4, batch=4, loss_directions=8, optimizer="adam", held_out=0)


def _train(path: Path) -> object:
    run = TrainingRun(["0", "1"], lambda name: _TEXTURES[int(str(name))], state=path)
    return CODECS["custom"].train(run, NetworkRecipe(_SETTINGS, _RECIPE, steps=2))


# Encodings, and stages of the default codec


def _encode(path: Path) -> object:
    values = np.linspace(0.0, 1.0, 2 * 3 * 2 * 3, dtype="<f4").reshape(2, 3, 2, 3)
    w = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]], np.float32)
    made = TableBtf(values, w, w[::-1].copy(), "cloth")

    def stop(stage: str, done: int, total: int, note: str) -> None:
        raise KeyboardInterrupt

    with suppress(KeyboardInterrupt):
        encode(made, codec(), texels_per_block=2, state=path, progress=stop)
    return path.stat()


def _blocks(data: bytes, random: Random) -> bytes:
    """A state of an encoding with damaged blocks whose checksums are right."""
    head, _, rest = _state(_encode).partition(b"\n")
    size = json.loads(head)["nacre records"]["size"]
    for start in range(0, len(rest), 4 + size):
        record = mutated(rest[start + 4 : start + 4 + size], random)[:size].ljust(size, b"\0")
        head += (b"" if start else b"\n") + zlib.crc32(record).to_bytes(4, "little") + record
    return head


def _absent() -> NoReturn:
    raise AssertionError("a state that is there was not taken")


def _functions(path: Path) -> object:
    found = kept(Store(path), "", AngularFunctions, _absent)
    with np.errstate(all="ignore"):
        return found(*COARSE)


def _write_functions(path: Path) -> None:
    numbers, tensors = pack_fields(codec().functions)
    Store(path).save({"numbers": numbers, "tensors": tensors})


# Manifests


def _records() -> list[Record]:
    whole = Record(
        "a/ggx.binary", "0" * 64, 4332, 17, "1" * 64, "0.2.0", "ggx.safetensors", "2" * 64,
        {"training loss": 0.1}, 1.5, None, "3" * 64,
    )  # fmt: skip
    failed = Record("broken.binary", None, None, None, "1" * 64, "0.2.0", "b.json", error="bad")
    return [whole, failed]


def _write_manifest(path: Path) -> None:
    manifest = Manifest(path.parent)
    for record in _records():
        manifest.keep(record)


def _read_manifest(path: Path) -> None:
    manifest = Manifest(path.parent)
    assert all(isinstance(record.output, str) for record in manifest.records())
    manifest.keep(_records()[0])
    assert Manifest(path.parent).find("ggx.safetensors") == _records()[0], "a record was lost"
    before = {record.output for record in manifest.records()}
    manifest.tidy(before)
    assert {record.output for record in Manifest(path.parent).records()} == before


def _lines(data: bytes, random: Random) -> bytes:
    """A manifest with a line that is odd JSON, and one that is damaged."""
    lines = [json.dumps(vars(record)).encode() for record in _records()]
    place = random.randrange(len(lines))
    odd = json_damage(lambda: [lines[place]])(data, random)
    return b"\n".join([odd, mutated(lines[0], random), lines[place]])


def _settings() -> dataset.Settings:
    w = np.array([[0.0, 0.0, 1.0]], np.float32)
    return dataset.Settings(w, w)


def _settle(path: Path) -> None:
    dataset._settle(path, _settings(), built_in())


# Journals, notes and results


_ROWS = f"{','.join(COLUMNS)}\r\n10,1.50,0.003,0.25,\r\n20,3.00,0.002,0.125,0.5\r\n"


def _read_journal(path: Path) -> None:
    with Journal(path, 20) as journal:
        journal.add(30, 4.0, 1e-3, 0.1, None)


def _read_notes(path: Path) -> None:
    Transfer(path.with_name(path.stem))._arrived("https://example.org/a.binary")
    _recorded(path)


_NOTE = {"url": "https://example.org/a.binary", "validator": '"abc"', "sha256": "0" * 64}


@cache
def _state(write: Callable[[Path], object]) -> bytes:
    return written("a.state", write)


def _states(
    name: str,
    run: Callable[[Path], object],
    seed: Callable[[Path], object] | None = None,
    rebuild: Rebuild | None = None,
) -> Reader:
    def files() -> list[bytes]:
        return [_state(seed or run)]

    return reader(name, "a.state", files, rebuild or tensors_damage(files), run, writes=True)


def _manifests() -> list[bytes]:
    return [written(MANIFEST, _write_manifest)]


def _captures() -> list[bytes]:
    return [written(dataset.MANIFEST, _settle)]


def _journals() -> list[bytes]:
    return [_ROWS.encode()]


def _notes() -> list[bytes]:
    return [json.dumps(_NOTE).encode()]


READERS = (
    _states("state of a training of a basis", _descend),
    _states("state of a training of a network for textures", _train),
    _states("state of an encoding", _encode, rebuild=_blocks),
    _states("stage of a training of the codec", _functions, _write_functions),
    reader("library", MANIFEST, _manifests, _lines, _read_manifest, writes=True),
    reader("captures", dataset.MANIFEST, _captures, json_damage(_captures), _settle),
    reader(
        "journal", "a.csv", _journals, words_damage(_journals, (",", '"', "\n", "\r")),
        _read_journal, writes=True,
    ),
    reader("notes of downloads", "a.part.json", _notes, json_damage(_notes), _read_notes),
)  # fmt: skip
