"""Studies of speed and of single choices, on the trials and the cache of
:mod:`nacre_lab.reproduce`.

`python -m lab.studies.speed.NAME` or `python -m lab.studies.ablations.NAME`, from the root of the
repository; all take `--data`, `-o`, `--seed` and `--quick` (:mod:`lab.studies.study`). Apart from
them, `python -m lab.studies.mutation` finds which small changes of the source no test notices; it
imports nothing of nacre by itself, so that changes count from the first import.
"""
