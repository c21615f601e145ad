"""Studies of speed and of single choices, on the trials and the cache of
:mod:`nacre_lab.reproduce`.

`python -m lab.studies.speed.NAME` or `python -m lab.studies.ablations.NAME`, from the root of the
repository; all take `--data`, `-o`, `--seed` and `--quick` (:mod:`lab.studies.study`).
"""
