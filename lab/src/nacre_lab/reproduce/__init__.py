"""The tables and figures of both papers, reproduced from any materials and textures.

Every pair of a material and a method is tried once (:mod:`nacre_lab.reproduce.trial`) and cached in
a folder (:mod:`nacre_lab.reproduce.cache`), as are the results of codecs on textures
(:mod:`nacre_lab.reproduce.textures`); each experiment is a view of the cached results.
"""

from nacre.registry import Registry
from nacre_lab.reproduce.experiment import Experiment

_MODULES = {
    "code_table": "table2",
    "representations": "table1 table3 fig2 fig5 fig6 fig7 fig8 fig9 fig10 fig17",
    "code_figures": "fig11 fig12",
    "noise_figures": "fig13 fig14 fig15 fig16",
    "textures.experiments": "btf-table1 btf-ablations btf-training btf-decoder "
    "btf-fig4 btf-fig5 btf-fig6 btf-fig7 btf-fig8 btf-fig9 btf-fig10 btf-tsne btf-video",
}

EXPERIMENTS: Registry[Experiment] = Registry(
    "nacre.experiments",
    "experiment",
    {
        name: f"nacre_lab.reproduce.{module}:{name.upper().replace('-', '_')}"
        for module, names in _MODULES.items()
        for name in names.split()
    },
)
"""Every table and figure by name; those from the paper on textures begin with `btf-`."""
