"""Studies of speed and of single choices, on the trials and the cache of :mod:`nacre.reproduce`.

`python -m studies.speed.NAME` or `python -m studies.ablations.NAME`, from the root of the
repository; all take `--data`, `-o`, `--seed` and `--quick` (:mod:`studies.study`).
"""
