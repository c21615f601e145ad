"""The verb `nacre.export`, as a module with the names of 0.2; see `nacre.verbs.moved`."""

from nacre.verbs import exporting as _exporting
from nacre.verbs import moved as _moved

_moved.become(__name__, _exporting.export)
