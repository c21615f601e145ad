"""Runners of exported textures, one module each."""
