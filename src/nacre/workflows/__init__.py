"""Work on files: fits of materials, encoded textures, trained codecs and bases, renderings.

:func:`fit_files` fits single files, :func:`fit_library` all measured files in folders: it finds
them (`sources`), skips the fits that are up to date by the `manifest`, and has an `executor` run
the others: threads, a batch on a GPU (`stacks`) or a Dask `cluster`.
"""

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre.workflows.bases import train_basis
    from nacre.workflows.cluster import Cluster
    from nacre.workflows.codec_training import train_codec
    from nacre.workflows.encoding import encode_texture
    from nacre.workflows.executor import Executor, Threads
    from nacre.workflows.files import FittedFile, fit_files, output_paths
    from nacre.workflows.fitting import (
        AnalyticFitting,
        Fitting,
        NetworkFitting,
        SpectralFitting,
    )
    from nacre.workflows.inspection import inspect
    from nacre.workflows.manifest import MANIFEST, Manifest, Record
    from nacre.workflows.plausible import draw_materials, plausibility, project_material
    from nacre.workflows.run import fit_library
    from nacre.workflows.sources import Source, find_sources, output_names
    from nacre.workflows.stacks import Stacks
    from nacre.workflows.texel import texture_reflectance
    from nacre.workflows.watcher import Watcher

__all__ = [
    "MANIFEST",
    "AnalyticFitting",
    "Cluster",
    "Executor",
    "FittedFile",
    "Fitting",
    "Manifest",
    "NetworkFitting",
    "Record",
    "Source",
    "SpectralFitting",
    "Stacks",
    "Threads",
    "Watcher",
    "draw_materials",
    "encode_texture",
    "find_sources",
    "fit_files",
    "fit_library",
    "inspect",
    "output_names",
    "output_paths",
    "plausibility",
    "project_material",
    "texture_reflectance",
    "train_basis",
    "train_codec",
]

__getattr__, __dir__, _ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "bases": ["train_basis"],
        "cluster": ["Cluster"],
        "codec_training": ["train_codec"],
        "encoding": ["encode_texture"],
        "executor": ["Executor", "Threads"],
        "files": ["FittedFile", "fit_files", "output_paths"],
        "fitting": ["AnalyticFitting", "Fitting", "NetworkFitting", "SpectralFitting"],
        "inspection": ["inspect"],
        "manifest": ["MANIFEST", "Manifest", "Record"],
        "plausible": ["draw_materials", "plausibility", "project_material"],
        "run": ["fit_library"],
        "sources": ["Source", "find_sources", "output_names"],
        "stacks": ["Stacks"],
        "texel": ["texture_reflectance"],
        "watcher": ["Watcher"],
    },
)
