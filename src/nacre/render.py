"""The verb `nacre.render`, as a module with the names of 0.2; see `nacre.verbs.moved`."""

from nacre.verbs import moved as _moved
from nacre.verbs import rendering as _rendering

_moved.become(__name__, _rendering.render)
