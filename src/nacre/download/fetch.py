"""Files of a database: found in the cache, or downloaded, checked and recorded."""

from __future__ import annotations

import json
import os
import re
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import platformdirs

from nacre.download.databases import Database
from nacre.download.transfer import Progress, Transfer, TransferError, without_credentials
from nacre.errors import NacreError
from nacre.formats import load
from nacre.io.disguise import disguise
from nacre.io.files import PathLike, digest, first_bytes, write_encoded
from nacre.io.outputs import check_replaceable, overwrite
from nacre.io.source import TERMS
from nacre.runtime.lock import exclusive


@dataclass(frozen=True)
class Fetched:
    """A file of a database."""

    path: Path
    sha256: str  # in hexadecimal
    verified: bool  # the checksum is the known one of the database's file
    fresh: bool  # the file was downloaded just now


def cache_folder() -> Path:
    """The folder for downloads: `NACRE_CACHE`, else the platform's cache folder."""
    named = os.environ.get("NACRE_CACHE")
    return Path(named).expanduser() if named else Path(platformdirs.user_cache_dir("nacre"))


def fetch(
    database: Database,
    material: str,
    folder: PathLike | None = None,
    mirror: str | None = None,
    agree: Callable[[str], bool] = lambda terms: False,
    progress: Progress | None = None,
) -> Fetched:
    """The file of a material, downloaded if necessary.

    The file appears complete and checked, or not at all, with the terms of use and a record of
    address, checksum and date beside it. If no checksum is known, the one in the record counts from
    then on. Another file of that name is replaced only if it was downloaded and has not changed
    since: see :mod:`nacre.io.outputs`.

    Parameters
    ----------
    database, material
        See :func:`nacre.download.find`.
    folder
        Where to put it; by default, a folder named after the database in :func:`cache_folder`.
    mirror
        Address that offers `DATABASE/FILE`; the environment's `NACRE_MIRROR` by default.
    agree
        Called with the terms of use before the first download to a folder, unless the database is
        free of conditions; returns whether the user accepts them.
    progress
        Called with the number of bytes received, and the total or None.

    Raises
    ------
    NacreError
        If the material is unknown, the terms are not accepted, the server cannot be reached
        (:class:`UnreachableError`) or does not have the file, the file is not the expected one, or
        the folder cannot be written.
    """
    facts = database.facts(material)
    path = destination(database, material, folder)
    folder = path.parent
    record = path.with_name(path.name + ".json")
    try:
        if found := _present(path, record, facts.sha256):
            return found
        url = database.address(material, mirror or os.environ.get("NACRE_MIRROR") or None)
        with overwrite(_is_damaged(path, record)):
            check_replaceable(path)
        _accept(database, folder, agree)
        with exclusive(path.with_name(f".{path.name}.lock")):
            return _present(path, record, facts.sha256) or _download(
                database, material, url, path, record, progress
            )
    except TransferError as error:
        source = database.address(material) if database.url else database.page
        hint = f"the file can also be fetched by hand from {source} and put at {path}"
        raise type(error)(f"{error}; {hint}") from error
    except OSError as error:
        raise NacreError(f"{path}: cannot be read or written: {error.strerror}") from error


def destination(database: Database, material: str, folder: PathLike | None = None) -> Path:
    """Where :func:`fetch` puts a file; NacreError if the material is unknown."""
    parent = Path(folder) if folder is not None else cache_folder() / database.name
    return parent / database.file_name(material)


def _present(path: Path, record: Path, known: str | None) -> Fetched | None:
    """The file, if it exists and is the right one; None if it must be downloaded."""
    if not path.is_file():
        return None
    sha256 = digest(path)
    if known is not None:
        return Fetched(path, sha256, True, False) if sha256 == known else None
    first = _recorded(record)
    if first is None:
        load(path)
    elif sha256 != first:
        raise NacreError(
            f"{path}: is not the file that was downloaded (SHA-256 {first}); delete it to download "
            f"it again, or delete {record} to accept it"
        )
    return Fetched(path, sha256, False, False)


def downloaded(folder: Path) -> Iterator[Path]:
    """Files in the folder of a database that are as they were downloaded, and their records."""
    for record in sorted(folder.glob("*.json")):
        path = record.with_suffix("")
        if path.is_file() and digest(path) == _recorded(record):
            yield from (path, record)


def _recorded(record: Path) -> str | None:
    """Checksum of an earlier download."""
    value = _known(record).get("sha256")
    return value if isinstance(value, str) else None


def _is_damaged(path: Path, record: Path) -> bool:
    """Whether a file is an earlier download that nobody has written to since, whatever is in it."""
    known = _known(record)
    try:
        status = path.lstat()
    except OSError:
        return False
    same = (status.st_size, status.st_mtime_ns) == (known.get("bytes"), known.get("modified_ns"))
    return same and stat.S_ISREG(status.st_mode) and bool(status.st_mode & 0o222)


def _known(record: Path) -> dict[str, Any]:
    """What is known of an earlier download."""
    try:
        content = json.loads(record.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _accept(database: Database, folder: Path, agree: Callable[[str], bool]) -> None:
    """Ask about the terms of use unless they were accepted for this folder, and store them."""
    kept = folder / f"{database.name}{TERMS}"
    if kept.is_file() and kept.read_text(encoding="utf-8", errors="replace") == database.terms:
        return
    if not database.free and not agree(database.terms):
        raise NacreError(f"{database.name}: the terms of use are not accepted; nothing downloaded")
    folder.mkdir(parents=True, exist_ok=True)
    write_encoded(kept, str.encode, database.terms, internal=True)


def _download(
    database: Database, material: str, url: str, path: Path, record: Path, progress: Progress | None
) -> Fetched:
    facts = database.facts(material)
    first, damaged = _recorded(record), _is_damaged(path, record)
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    transfer = Transfer(part, facts.size, database.limit, progress)
    transfer(url)
    public, sha256 = without_credentials(url), digest(part)
    if found := disguise(first_bytes(part), path):
        transfer.discard()
        problem = re.split("[,:;]", found)[0]
        fix = "open the address in a browser to see what it says, or try another mirror"
        raise NacreError(f"{public}: {problem}, not the file; discarded; {fix}")
    if sha256 != (expected := facts.sha256 or first or sha256):
        transfer.discard()
        problem, fix = f" does not have the SHA-256 {expected}", "try again, or another mirror"
        if not facts.sha256:
            problem = f" no longer has the SHA-256 of the first download, {expected}"
            fix = f"delete {record} to accept the new file"
        raise NacreError(f"{public}: the file{problem}; discarded; {fix}")
    if facts.sha256 is None and first is None:
        try:
            load(part)
        except NacreError as error:
            transfer.discard()
            problem = str(error).replace(str(part), "the file", 1)
            raise NacreError(f"{public}: {problem}; discarded; try another mirror") from error
    verified = facts.sha256 is not None
    content = {
        "database": database.name,
        "material": material,
        "url": public,
        "bytes": part.stat().st_size,
        "modified_ns": part.stat().st_mtime_ns,
        "sha256": sha256,
        "verified": verified,
        "downloaded": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    # Write the record first: a file without one would count as put there by hand.
    write_encoded(record, str.encode, json.dumps(content, indent=1) + "\n", internal=True)
    with overwrite(damaged):
        check_replaceable(path)
    with part.open("rb+") as file:
        os.fsync(file.fileno())
    part.replace(path)
    return Fetched(path, sha256, verified, True)
