"""Jobs over files: materials fitted, textures encoded, codecs and bases trained.

:func:`fit_files` fits lone files. :func:`fit_library` fits every measured file in folders and goes
on where a run stopped: it finds the files (:mod:`nacre.workflows.sources`), skips those whose fit
is up to date by the manifest (:mod:`nacre.workflows.manifest`), and has the others fitted a few at
a time (:mod:`nacre.workflows.run`), in threads (:mod:`nacre.workflows.executor`), as one batch on a
GPU (:mod:`nacre.workflows.stacks`) or on a Dask cluster (:mod:`nacre.workflows.cluster`).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "basis_training": ["train_basis"],
        "cluster": ["Cluster"],
        "codec_training": ["TrainedCodec", "train_codec"],
        "encoding": ["EncodedTexture", "encode", "encode_texture"],
        "executor": ["Executor", "Threads"],
        "files": ["FittedFile", "fit_files", "output_paths"],
        "fitting": ["AnalyticFitting", "Fitting", "NetworkFitting"],
        "manifest": ["MANIFEST", "Manifest", "Record"],
        "measuring": ["described_bsdf", "scene_bsdf"],
        "run": ["Outcome", "fit_library"],
        "sources": ["Source", "find_sources", "output_names"],
        "stacks": ["Stacks"],
        "texel": ["texture_reflectance"],
        "texture_rendering": ["RenderedTexture", "TextureView", "render_texture"],
        "watcher": ["Watcher"],
    },
)
