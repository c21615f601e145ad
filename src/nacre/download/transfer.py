"""Download of one file over HTTP, resumed after a broken connection (RFC 9110, section 14)."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import requests
import urllib3

from nacre.errors import NacreError, reason

Progress = Callable[[int, int | None], None]
"""Called with the number of bytes received, and the total or None."""

TRIES = 5
"""Requests for one file before giving up."""

PAUSE = 0.5
"""Seconds before the second request, doubled before each further one."""

_TIMEOUT = (10.0, 30.0)  # seconds to connect, and without data
_CHUNK = 2**16
_TRY_AGAIN = (408, 429, 500, 502, 503, 504)
_HOPELESS = (  # the address, or one that the server redirects to, is wrong
    requests.TooManyRedirects,
    requests.exceptions.InvalidSchema,
    requests.exceptions.InvalidURL,
    requests.exceptions.MissingSchema,
)


class TransferError(NacreError):
    """A server that cannot be reached, or does not send the file."""


class UnreachableError(TransferError):
    """A server to which there is no connection."""


class _BrokenOffError(Exception):
    """A transfer that another request may finish."""


@dataclass
class Transfer:
    """Downloads of one file.

    The received bytes stay in `part`, and a note in `part` with `.json` added tells whether the
    file on the server is still the same: its address, and its entity tag or date. A later call
    continues from there. A file is refused if its length in bytes is not `size`, if that is known,
    or is more than `limit`.
    """

    part: Path
    size: int | None = None
    limit: int = 2**29
    progress: Progress | None = None

    def __call__(self, url: str) -> None:
        """Download `url` to :attr:`part`.

        A :class:`TransferError` means that the server cannot be reached
        (:class:`UnreachableError`), refuses, or sends a file of another length; an OSError that the
        file cannot be written.
        """
        host = urlsplit(url).hostname or url
        arrived = self._arrived(url)
        problem = ""
        with requests.Session() as session:
            for attempt in range(TRIES):
                if attempt:
                    time.sleep(PAUSE * 2 ** (attempt - 1))
                try:
                    self._request(session, url)
                except _BrokenOffError as error:
                    problem = str(error)
                except requests.RequestException as error:
                    problem = _reason(error)
                    if isinstance(error, _HOPELESS):
                        raise TransferError(f"{host}: {problem}") from error
                    if _out_of_reach(error) and self._arrived(url) == arrived:
                        raise UnreachableError(f"cannot reach {host}: {problem}") from error
                except (ValueError, urllib3.exceptions.HTTPError) as error:  # in headers
                    raise TransferError(f"{host}: invalid answer: {reason(error)}") from error
                else:
                    self._note.unlink(missing_ok=True)
                    return
        kept = self._arrived(url)
        rest = f"; {kept:,} bytes are kept, run it again to continue" if kept else ""
        raise TransferError(f"{host}: gave up after {TRIES} tries: {problem}{rest}")

    @property
    def _note(self) -> Path:
        return self.part.with_name(self.part.name + ".json")

    def _validator(self, url: str) -> str | None:
        """The validator of the content in the part file, if it is from this address."""
        try:
            note = json.loads(self._note.read_text(encoding="utf-8"))
            return str(note["validator"]) if note["url"] == without_credentials(url) else None
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None

    def _arrived(self, url: str) -> int:
        """Bytes that a request can continue from."""
        if self._validator(url) is None or not self.part.is_file():
            return 0
        return self.part.stat().st_size

    def _request(self, session: requests.Session, url: str) -> None:
        """One request; returns when the part file is complete."""
        start = self._arrived(url)
        headers = {"Accept-Encoding": "identity"}
        if start:
            headers |= {"Range": f"bytes={start}-", "If-Range": self._validator(url) or ""}
        with session.get(url, headers=headers, stream=True, timeout=_TIMEOUT) as response:
            if response.status_code == 416:  # nothing is left, or the file shrank
                self._note.unlink(missing_ok=True)
                raise _BrokenOffError("the server has no more of the file")
            answer, public = f"{response.status_code} {response.reason}", without_credentials(url)
            if response.status_code in _TRY_AGAIN:
                raise _BrokenOffError(answer)
            if response.status_code not in (200, 206):
                raise TransferError(f"{urlsplit(url).hostname}: {answer}: {public}")
            if response.headers.get("Content-Type", "").startswith("text/html"):
                raise TransferError(f"{public}: is a web page, not a file")
            if response.status_code == 200:
                start = 0
            total = self._total(response, url, start)
            if start == 0:
                self._begin(url, response)
            self._receive(response, url, start, total)

    def _total(self, response: requests.Response, url: str, start: int) -> int | None:
        """Length of the whole file, if it is known."""
        if response.status_code == 206:
            pattern = r"bytes (\d+)-\d+/(\d+|\*)"
            match = re.fullmatch(pattern, response.headers.get("Content-Range", ""))
            same = _validator(response) in (None, self._validator(url))
            if match is None or int(match[1]) != start or not same:
                self._note.unlink(missing_ok=True)
                raise _BrokenOffError("the server sent another part or file than requested")
            told = None if match[2] == "*" else int(match[2])
        else:
            length = response.headers.get("Content-Length", "")
            told = int(length) if length.isdecimal() else None
        expected = self.size if self.size is not None else told
        if told != expected and told is not None:
            raise self._wrong_length(url, f"is {told:,} bytes long")
        if expected is not None and expected > self.limit:
            raise self._wrong_length(url, f"is {expected:,} bytes long")
        return expected

    def _begin(self, url: str, response: requests.Response) -> None:
        """Empty the part file, and note what it will hold."""
        self._note.unlink(missing_ok=True)
        self.part.write_bytes(b"")
        # Without a validator, two versions of the file could be joined.
        if validator := _validator(response):
            note = {"url": without_credentials(url), "validator": validator}
            self._note.write_text(json.dumps(note), encoding="utf-8")

    def _receive(self, response: requests.Response, url: str, done: int, total: int | None) -> None:
        bound = self.limit if total is None else total
        with self.part.open("ab") as file:
            for chunk in response.iter_content(_CHUNK):
                done += len(chunk)
                if done > bound:
                    raise self._wrong_length(url, f"continues after {bound:,} bytes")
                file.write(chunk)
                if self.progress:
                    self.progress(done, total)
        if total is not None and done < total:
            raise _BrokenOffError(f"the connection broke off after {done:,} of {total:,} bytes")

    def discard(self) -> None:
        """Remove the received bytes."""
        self._note.unlink(missing_ok=True)
        self.part.unlink(missing_ok=True)

    def _wrong_length(self, url: str, problem: str) -> TransferError:
        """The error about a wrong file, of which nothing is kept."""
        self.discard()
        expected = f"{self.size:,}" if self.size is not None else f"at most {self.limit:,}"
        return TransferError(f"{without_credentials(url)}: {problem}, expected {expected}")


def _validator(response: requests.Response) -> str | None:
    """The identity of the content on the server: a strong entity tag, else its date."""
    tag = response.headers.get("ETag", "")
    return tag if tag.startswith('"') else response.headers.get("Last-Modified")


def without_credentials(url: str) -> str:
    """An address without a user's name and password."""
    parts = urlsplit(url)
    return parts._replace(netloc=parts.netloc.rpartition("@")[2]).geturl()


def _out_of_reach(error: requests.RequestException) -> bool:
    """Whether there was no connection, so that another try would not help."""
    if isinstance(error, requests.Timeout):
        return isinstance(error, requests.ConnectTimeout)
    if isinstance(error, requests.exceptions.SSLError | requests.exceptions.ProxyError):
        return True
    return isinstance(_root(error), urllib3.exceptions.NewConnectionError)


def _root(error: requests.RequestException) -> Any:
    cause = error.args[0] if error.args else error
    return getattr(cause, "reason", None) or cause


def _reason(error: requests.RequestException) -> str:
    """What went wrong, without the library's object addresses and pool names."""
    if isinstance(error, requests.Timeout):
        return "no answer in time"
    if isinstance(error, requests.exceptions.ChunkedEncodingError):
        return "the connection broke off"
    root = _root(error)
    if not isinstance(root, BaseException):
        return str(root)
    inner = root.__cause__ or root.__context__ or root
    text = getattr(inner, "strerror", None) or str(inner)
    return str(text).partition("\n")[0]
