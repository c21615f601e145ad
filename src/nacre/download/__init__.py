"""Files of the public databases of measured materials."""

from __future__ import annotations

from nacre.download.databases import Database, Facts, databases, find
from nacre.download.fetch import Fetched, cache_folder, destination, fetch

__all__ = [
    "Database",
    "Facts",
    "Fetched",
    "cache_folder",
    "databases",
    "destination",
    "fetch",
    "find",
]
