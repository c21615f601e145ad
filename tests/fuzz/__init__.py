"""Fuzzing of every reader with atheris: `python -m tests.fuzz --help`."""
