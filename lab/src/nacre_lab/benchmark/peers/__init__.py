"""Representations from papers by others, each our own implementation from its description."""
