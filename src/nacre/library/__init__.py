"""Whole folders of materials: every measured file in them fitted, resumed where a run stopped.

:func:`fit_library` finds the files (:mod:`nacre.library.sources`), skips those whose fit is up to
date by the manifest (:mod:`nacre.library.manifest`), and fits the others a few at a time
(:mod:`nacre.library.run`).
"""

from nacre.library.fitting import AnalyticFitting, Fitting, NetworkFitting
from nacre.library.manifest import MANIFEST, Manifest, Record
from nacre.library.run import Outcome, Watcher, fit_library
from nacre.library.sources import Source, find_sources, output_names

__all__ = [
    "MANIFEST",
    "AnalyticFitting",
    "Fitting",
    "Manifest",
    "NetworkFitting",
    "Outcome",
    "Record",
    "Source",
    "Watcher",
    "find_sources",
    "fit_library",
    "output_names",
]
