"""Jobs over files: materials fitted, textures encoded, codecs and bases trained.

:func:`fit_files` fits lone files. :func:`fit_library` fits every measured file in folders and goes
on where a run stopped: it finds the files (:mod:`nacre.workflows.sources`), skips those whose fit
is up to date by the manifest (:mod:`nacre.workflows.manifest`), and has the others fitted a few at
a time (:mod:`nacre.workflows.run`), in threads (:mod:`nacre.workflows.executor`), as one batch on a
GPU (:mod:`nacre.workflows.stacks`) or on a Dask cluster (:mod:`nacre.workflows.cluster`).
"""

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre.workflows.bases import train_basis
    from nacre.workflows.cluster import Cluster
    from nacre.workflows.codec_training import TrainedCodec, train_codec
    from nacre.workflows.encoding import EncodedTexture, encode, encode_texture
    from nacre.workflows.executor import Executor, Threads
    from nacre.workflows.files import FittedFile, fit_files, output_paths
    from nacre.workflows.fitting import AnalyticFitting, Fitting, NetworkFitting
    from nacre.workflows.inspection import Inspection, inspect
    from nacre.workflows.manifest import MANIFEST, Manifest, Record
    from nacre.workflows.plausible import draw_materials, plausibility, project_material
    from nacre.workflows.run import Outcome, fit_library
    from nacre.workflows.sources import Source, find_sources, output_names
    from nacre.workflows.stacks import Stacks
    from nacre.workflows.texel import texture_reflectance
    from nacre.workflows.texture_rendering import RenderedTexture, TextureView, render_texture
    from nacre.workflows.watcher import Watcher

__all__ = [
    "MANIFEST",
    "AnalyticFitting",
    "Cluster",
    "EncodedTexture",
    "Executor",
    "FittedFile",
    "Fitting",
    "Inspection",
    "Manifest",
    "NetworkFitting",
    "Outcome",
    "Record",
    "RenderedTexture",
    "Source",
    "Stacks",
    "TextureView",
    "Threads",
    "TrainedCodec",
    "Watcher",
    "draw_materials",
    "encode",
    "encode_texture",
    "find_sources",
    "fit_files",
    "fit_library",
    "inspect",
    "output_names",
    "output_paths",
    "plausibility",
    "project_material",
    "render_texture",
    "texture_reflectance",
    "train_basis",
    "train_codec",
]

__getattr__, __dir__, _ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "bases": ["train_basis"],
        "cluster": ["Cluster"],
        "codec_training": ["TrainedCodec", "train_codec"],
        "encoding": ["EncodedTexture", "encode", "encode_texture"],
        "executor": ["Executor", "Threads"],
        "files": ["FittedFile", "fit_files", "output_paths"],
        "fitting": ["AnalyticFitting", "Fitting", "NetworkFitting"],
        "inspection": ["Inspection", "inspect"],
        "manifest": ["MANIFEST", "Manifest", "Record"],
        "plausible": ["draw_materials", "plausibility", "project_material"],
        "run": ["Outcome", "fit_library"],
        "sources": ["Source", "find_sources", "output_names"],
        "stacks": ["Stacks"],
        "texel": ["texture_reflectance"],
        "texture_rendering": ["RenderedTexture", "TextureView", "render_texture"],
        "watcher": ["Watcher"],
    },
)
