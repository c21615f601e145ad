"""Formulas on components as machine code."""
