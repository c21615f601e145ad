"""What `import nacre.export` finds: the verb, with the names of 0.2; see `nacre.verbs.moved`."""

from nacre.verbs.moved import export, take_place

take_place(__name__, export)
