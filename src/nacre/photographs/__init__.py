"""Estimates materials from photographs in known light."""
