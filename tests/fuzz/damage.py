"""Damage that keeps to the grammar of a file: JSON, safetensors, lines of words, XML."""

from __future__ import annotations

import json
import random as randoms
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tests.specimens.networks import safetensors_bytes
from tests.specimens.specimen import NUMBERS, VALUES, Array, odd_array, odd_json, odd_shape

Random = randoms.Random
Rebuild = Callable[[bytes, Random], bytes]

_DTYPES = {"F64": "<f8", "F32": "<f4", "F16": "<f2", "I64": "<i8", "I32": "<i4", "U8": "u1"}
_FLOATS = "<f8", "<f4", "<f2"
_DEEP = 20_000


def _places(content: Any) -> list[tuple[Any, Any]]:
    """Containers and keys of everything within."""
    found, waiting = [], [content]
    while waiting:
        value = waiting.pop()
        items = list(value.items()) if isinstance(value, dict) else list(enumerate(value))
        for key, part in items:
            found.append((value, key))
            if isinstance(part, dict | list):
                waiting.append(part)
    return found


def change_json(content: Any, random: Random) -> Any:
    """The content with a part or two replaced, removed or copied; it is changed itself."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        places = _places(content) if isinstance(content, dict | list) else []
        if not places:
            return odd_json(random)
        holder, key = random.choice(places)
        choice = random.random()
        if choice < 0.15:
            del holder[key]
        elif choice < 0.3:
            other, name = random.choice(places)
            if name in (other if isinstance(other, dict) else range(len(other))):
                holder[key] = json.loads(json.dumps(other[name]))
        elif choice < 0.4 and isinstance(holder, dict):
            holder[random.choice(("", "x", "$array", "type", "é\n", str(key)))] = odd_json(random)
        else:
            holder[key] = odd_json(random)
    return content


def json_damage(files: Callable[[], Sequence[bytes]]) -> Rebuild:
    """Files of JSON, whole but for a part; a few are nested too deep or have endless numbers."""

    def rebuild(data: bytes, random: Random) -> bytes:
        choice = random.random()
        whole = json.loads(random.choice(files()))
        if choice < 0.08 and (places := _places(whole)):
            holder, key = random.choice(places)
            holder[key] = "@"
            part = "[" * _DEEP + "]" * _DEEP if choice < 0.04 else "9" * 5000
            return json.dumps(whole).replace('"@"', part).encode()
        text = json.dumps(change_json(whole, random))
        return text.encode("utf-8" if choice < 0.95 else "utf-16")

    return rebuild


def parse_tensors(data: bytes) -> tuple[str, Any, dict[str, Array]]:
    """Name and content of the header, and the tensors, of a whole file of ours."""
    size = int.from_bytes(data[:8], "little")
    described = json.loads(data[8 : 8 + size])
    (key,) = described["__metadata__"]
    tensors = {}
    for name, entry in described.items():
        if name != "__metadata__":
            start, end = (8 + size + offset for offset in entry["data_offsets"])
            array = np.frombuffer(data[start:end], _DTYPES[entry["dtype"]])
            tensors[name] = array.reshape(entry["shape"])
    return key, json.loads(described["__metadata__"][key]), tensors


def tensors_damage(files: Callable[[], Sequence[bytes]]) -> Rebuild:
    """Safetensors files of ours that hold together, with another header or other tensors."""

    def rebuild(data: bytes, random: Random) -> bytes:
        key, header, tensors = parse_tensors(random.choice(files()))
        for _ in range(random.choice((1, 1, 2))):
            name = random.choice([*tensors, ""])
            choice = random.random()
            if choice < 0.5 or not name:
                header = change_json(header, random)
            elif choice < 0.7:
                tensors[name] = odd_array(random, tensors[name].shape, tensors[name].dtype.str)
            elif choice < 0.85:
                shape, dtype = odd_shape(random, random.randrange(4)), random.choice(_FLOATS)
                tensors[name] = odd_array(random, shape, dtype)
            elif choice < 0.95:
                dtype = random.choice(list(_DTYPES.values()))
                with np.errstate(all="ignore"):
                    tensors[name] = tensors[name].astype(dtype)
            else:
                del tensors[name]
        return safetensors_bytes(tensors, header, None, key)

    return rebuild


def words_damage(files: Callable[[], Sequence[bytes]], words: Sequence[str]) -> Rebuild:
    """Text some words of which, or marks between them, are those of other places or odd ones."""
    odd = [*words, *map(str, NUMBERS), *map(str, VALUES), "x" * 300, "é", "", "\0", "1_0", "٣", "²"]

    def rebuild(data: bytes, random: Random) -> bytes:
        parts = re.split(r"([\w.:+-]+)", random.choice(files()).decode(errors="replace"))
        for _ in range(random.choice((1, 1, 2, 5))):
            parts[random.randrange(len(parts))] = random.choice([*odd, random.choice(parts)])
        return "".join(parts).encode()

    return rebuild
