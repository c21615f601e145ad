"""Small changes of the source, and whether a test notices each: :mod:`lab.studies.mutation`."""
