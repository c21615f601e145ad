"""Measured reflectance: one module a file format."""
