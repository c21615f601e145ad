"""Textures as NumPy archives (`.npz`), mapped rather than read.

An archive holds `values` of shape (height, width, n, 3), reflectance factors as
:class:`nacre.btf.Btf` has them, in any of three precisions; `wi` and `wo`, unit directions of
shape (n, 3); and, if wanted, the text `name`. :func:`numpy.savez` writes such files and
:func:`numpy.load` reads them. Files in an archive that is not compressed lie there as they are, so
that values are mapped into memory and read as they are used.
"""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import IO, Any, Literal, TypeAlias

import numpy as np
import numpy.lib.format as npy
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf, Indices, TableBtf
from nacre.errors import FormatError
from nacre.io.files import PathLike, atomic_path, check_regular
from nacre.io.format import Format
from nacre.io.mapped import MappedFile
from nacre.io.npy import TEXT_LIMIT, archive_errors, map_npy, parse_npy, parse_text, unpack_member
from nacre.measured.textures.directions import PAIR_LIMIT, check_directions
from nacre.measured.textures.transposition import narrowed, narrowest_precision, transposed
from nacre.runtime.progress import Progress

Precision: TypeAlias = Literal["half", "single"]

_LISTING_LIMIT = 1 << 20  # most bytes that may be read at once: the list of what is in the archive
_BLOCK = 1 << 26
_ALIGNMENT = 64
_PAGE = 1 << 12
_PADDING = 0xD935  # kind of extra field that only pads, as of other programs that align
_DTYPES: dict[Precision, str] = {"half": "<f2", "single": "<f4"}
_ENCRYPTED = 1


class _ArchiveBtf(TableBtf):
    """Values in a file, which are checked as they are used."""

    not_content = frozenset({"_path", "_file"})

    def __init__(
        self, path: Path, file: MappedFile | None, values: npt.NDArray[Any], *rest: Any
    ) -> None:
        super().__init__(values, *rest)
        self._path, self._file = path, file

    def texels(self, chosen: Indices | slice) -> Floats:
        return self._checked(super().texels, chosen)

    def kept_texels(self, chosen: slice) -> npt.NDArray[Any]:
        """They are read from the disk here, but not checked: what is not finite shows in codes."""
        if self._file:
            self._file.check()
        found = super().kept_texels(chosen)
        found.reshape(-1).view(np.uint8)[::_PAGE].max(initial=0)
        return found

    def texels_at(self, chosen: Indices, pairs: Indices) -> Floats:
        return self._checked(super().texels_at, chosen, pairs)

    def images(self, chosen: Indices | slice) -> Floats:
        return self._checked(super().images, chosen)

    def _checked(self, read: Callable[..., Floats], *chosen: Indices | slice) -> Floats:
        if self._file:
            self._file.check()
        with np.errstate(over="ignore"):
            values = read(*chosen)
        if not np.isfinite(values).all():
            raise FormatError(f"{self._path}: values: some are not finite; write the file again")
        return np.require(values, requirements=["ALIGNED", "WRITEABLE", "ENSUREARRAY"])


def load(path: PathLike) -> TableBtf:
    """Read a NumPy archive of a texture, which must stay as it is while that is used.

    Values in a compressed one are unpacked into memory, up to eight times the file or 64 MiB.
    Checksums of values that are mapped are not compared. A :class:`FormatError` says what is
    damaged or missing; later, when values are used, that they are not finite, or that the file has
    been written over.
    """
    path, mapped = Path(path), None
    with _opened(path) as (archive, file, size):
        members = {m.filename: m for m in archive.infolist()}
        for name in ("values", "wi", "wo"):
            if f"{name}.npy" not in members:
                raise FormatError(f"{path}: has no array '{name}'; it needs values, wi and wo")

        def unpacked(name: str, limit: int) -> bytes:
            where = f"{path}: array '{name}'"
            return unpack_member(archive, members[f"{name}.npy"], limit, where)

        wi, wo = (_directions(unpacked(w, 0), f"{path}: array '{w}'") for w in ("wi", "wo"))
        name = path.stem
        if "name.npy" in members:
            name = parse_text(unpacked("name", 0), f"{path}: array 'name'") or name
        where = f"{path}: array 'values'"
        member = members["values.npy"]
        if member.compress_type == zipfile.ZIP_STORED and not member.flag_bits & _ENCRYPTED:
            mapped = MappedFile(path, size, file.fileno())
            values = map_npy(mapped, *_place(file, member, size, where), where)
        else:
            values = parse_npy(unpacked("values", size), where)
    shape = values.shape
    if len(shape) != 4 or shape[3] != 3 or not values.size:
        raise FormatError(f"{where}: has shape {shape}, expected (height, width, n, 3), none of 0")
    if not values.flags.c_contiguous:
        raise FormatError(f"{where}: is in Fortran order; save numpy.ascontiguousarray(values)")
    if not len(wi) == len(wo) == shape[2]:
        raise FormatError(f"{where}: has n = {shape[2]}; there are {len(wi)} wi, {len(wo)} wo")
    return _ArchiveBtf(path, mapped, values, wi, wo, name)


def save(
    btf: Btf, path: PathLike, precision: Precision | None = None, progress: Progress | None = None
) -> None:
    """Write a NumPy archive of any texture, whole or not at all, in little memory.

    The texture is read once, by runs of texels; images (:attr:`Btf.by_image`) are decoded once and
    put by texel in a temporary file beside `path` as large as the new one. By default the precision
    is "single" for a table that is wider than half, else "half" unless a value is too large for it,
    which in a given precision is a FormatError.
    """
    path = Path(path)
    if precision is None and isinstance(btf, TableBtf) and btf.values.dtype.itemsize > 2:
        precision = "single"
    dtype = precision and _DTYPES[precision]
    with (
        atomic_path(path) as temporary,
        transposed(btf, path.parent, dtype, progress=progress) as source,
    ):
        narrowest_precision(partial(_write, source, path, temporary, progress), dtype)


def _write(
    source: Btf, path: Path, temporary: Path, progress: Progress | None, dtype: np.dtype[Any]
) -> None:
    shape = (source.height, source.width, source.pair_count, 3)
    with temporary.open("wb") as file, zipfile.ZipFile(file, "w") as archive:
        name = np.array(source.name[:TEXT_LIMIT])
        for key, array in (("wi", source.wi), ("wo", source.wo), ("name", name)):
            with archive.open(zipfile.ZipInfo(f"{key}.npy"), "w") as member:
                npy.write_array(member, array, (1, 0), allow_pickle=False)
        with archive.open(_aligned("values.npy", file.tell()), "w", force_zip64=True) as member:
            header = {"descr": dtype.str, "fortran_order": False, "shape": shape}
            npy.write_array_header_1_0(member, header)
            for block in source.blocks(_BLOCK):
                member.write(narrowed(source.texels(block), dtype, str(path)).data)
                if progress:
                    progress("writing", block.stop, source.texel_count, "")


def _aligned(name: str, offset: int) -> zipfile.ZipInfo:
    """An entry, to be written at an offset, whose content starts at a round address."""
    start = offset + 30 + len(name) + 20  # with the sizes of a file beyond 4 GiB
    member = zipfile.ZipInfo(name)
    padding = -(start + 4) % _ALIGNMENT
    member.extra = struct.pack("<2H", _PADDING, padding) + bytes(padding)
    return member


@contextmanager
def _opened(path: Path) -> Iterator[tuple[zipfile.ZipFile, IO[bytes], int]]:
    """An archive, its file and its length; whatever goes wrong is a :class:`FormatError`."""
    with archive_errors(path):
        size = check_regular(path)
        if size == 0:
            raise FormatError(f"{path}: is empty")
        with _Sparing(path.open("rb", buffering=0)) as file, zipfile.ZipFile(file) as archive:
            file.sparing = False
            yield archive, file, size


class _Sparing(io.BufferedReader):
    """A file that at first refuses to read much: the list in an archive may claim any length."""

    sparing = True

    def read(self, size: int | None = -1, /) -> bytes:
        if not self.sparing:
            return super().read(size)
        size = _LISTING_LIMIT + 1 if size is None or size < 0 else size
        content = super().read(min(size, _LISTING_LIMIT + 1))
        if len(content) > _LISTING_LIMIT:
            raise FormatError(f"{self.name}: its list is longer than that of any texture")
        return content


def _directions(content: bytes, where: str) -> Floats:
    directions = parse_npy(content, where)
    if directions.ndim != 2 or directions.shape[1] != 3 or not 1 <= len(directions) <= PAIR_LIMIT:
        shape = directions.shape
        raise FormatError(f"{where}: has shape {shape}, expected (n, 3), n from 1 to {PAIR_LIMIT}")
    return check_directions(directions, where)


def _place(file: IO[bytes], member: zipfile.ZipInfo, size: int, where: str) -> tuple[int, int]:
    """Offset and length of a stored file: behind its local header, whose length varies."""
    file.seek(member.header_offset)
    local = file.read(30)
    name, extra = struct.unpack_from("<2H", local, 26)
    offset = member.header_offset + 30 + name + extra
    if not local.startswith(b"PK\3\4") or offset + member.file_size > size:
        raise FormatError(f"{where}: does not lie whole in the archive")
    return offset, member.file_size


def _is_archive(path: Path) -> bool:
    with suppress(FormatError), _opened(path) as (archive, _, _):
        return len({"values.npy", "wi.npy", "wo.npy"} & set(archive.namelist())) > 1
    return False


FORMAT = Format(
    "NumPy archive of a BTF",
    (".npz",),
    lambda head: head.startswith(b"PK\3\4") and not head.startswith(b"f_r.npy", 30),
    load,
    save,
    kind="btf",
    claims=_is_archive,
)
