"""What the commands run: folders of materials fitted, and latent bases trained.

:func:`fit_library` finds the files (:mod:`nacre.workflows.sources`), skips those whose fit is up to
date by the manifest (:mod:`nacre.workflows.manifest`), and has the others fitted a few at a time
(:mod:`nacre.workflows.run`), in threads (:mod:`nacre.workflows.executor`), as one batch on a GPU
(:mod:`nacre.workflows.stacks`) or on a Dask cluster (:mod:`nacre.workflows.cluster`).

:func:`train_basis` trains a latent basis on the same kinds of inputs.
"""

from nacre.workflows.bases import train_basis
from nacre.workflows.cluster import Cluster
from nacre.workflows.executor import Executor, Threads
from nacre.workflows.fitting import AnalyticFitting, Fitting, NetworkFitting
from nacre.workflows.manifest import MANIFEST, Manifest, Record
from nacre.workflows.run import Outcome, fit_library
from nacre.workflows.sources import Source, find_sources, output_names
from nacre.workflows.stacks import Stacks
from nacre.workflows.watcher import Watcher

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
    "train_basis",
]
