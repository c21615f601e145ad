"""Files of the public databases of measured materials."""

from __future__ import annotations

from nacre.download.databases import Database, Facts, databases, find
from nacre.download.fetch import Fetched, cache_folder, destination, fetch
from nacre.download.transfer import UnreachableError

__all__ = [
    "Database",
    "Facts",
    "Fetched",
    "UnreachableError",
    "cache_folder",
    "databases",
    "destination",
    "fetch",
    "find",
]
