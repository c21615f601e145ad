"""What `import nacre.render` finds: the verb, with the names of 0.2; see `nacre.verbs.moved`."""

from nacre.verbs.moved import render, take_place

take_place(__name__, render)
