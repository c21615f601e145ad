"""Whole folders of materials: every measured file in them fitted, resumed where a run stopped.

:func:`fit_library` finds the files (:mod:`nacre.library.sources`), skips those whose fit is up to
date by the manifest (:mod:`nacre.library.manifest`), and has the others fitted a few at a time
(:mod:`nacre.library.run`), in threads (:mod:`nacre.library.executor`), as one batch on a GPU
(:mod:`nacre.library.stacks`) or on a Dask cluster (:mod:`nacre.library.cluster`).
"""

from nacre.library.cluster import Cluster
from nacre.library.executor import Executor, Threads
from nacre.library.fitting import AnalyticFitting, Fitting, NetworkFitting
from nacre.library.manifest import MANIFEST, Manifest, Record
from nacre.library.run import Outcome, fit_library
from nacre.library.sources import Source, find_sources, output_names
from nacre.library.stacks import Stacks
from nacre.library.watcher import Watcher

__all__ = [
    "MANIFEST",
    "AnalyticFitting",
    "Cluster",
    "Executor",
    "Fitting",
    "Manifest",
    "NetworkFitting",
    "Outcome",
    "Record",
    "Source",
    "Stacks",
    "Threads",
    "Watcher",
    "find_sources",
    "fit_library",
    "output_names",
]
