"""Exported materials, run in the language that they were written in and compared with NumPy."""
