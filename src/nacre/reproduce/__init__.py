"""The NBRDF paper's tables and figures, made again from any materials.

Every pair of a material and a method is tried once (:mod:`nacre.reproduce.trial`) and kept in a
folder (:mod:`nacre.reproduce.cache`); each experiment (:mod:`nacre.reproduce.experiments`) is a
view of what was kept.
"""

from nacre.reproduce.experiments import EXPERIMENTS, Experiment
from nacre.reproduce.methods import Method, methods
from nacre.reproduce.study import Study, run
from nacre.reproduce.trial import Settings

__all__ = ["EXPERIMENTS", "Experiment", "Method", "Settings", "Study", "methods", "run"]
