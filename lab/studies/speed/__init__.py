"""How fast things are, each beside what bounds it: one module a study."""
