"""Peers for materials from few measurements: what others described, implemented here."""
