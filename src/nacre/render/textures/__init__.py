"""Textures of measured reflectance in Mitsuba: the plugins `neuralbtf` and `measuredbtf`."""
