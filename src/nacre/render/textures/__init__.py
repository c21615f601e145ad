"""Textures of measured reflectance in Mitsuba: the plugins `neuralbtf` and `measuredbtf`.

In all of it, `mi` is the `mitsuba` module with a JIT variant set.
"""
