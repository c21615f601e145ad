"""Textures of measured reflectance in Mitsuba: the plugins `neuralbtf` and `measuredbtf`.

Everywhere in this folder, `mi` is the `mitsuba` module with a JIT variant set.
"""
