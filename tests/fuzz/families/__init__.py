"""Readers to fuzz, one module a kind of file."""
