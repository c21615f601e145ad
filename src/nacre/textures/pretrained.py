"""The model of textures that comes with nacre."""

from __future__ import annotations

from pathlib import Path

PUBLISHED = Path(__file__).with_name("nacre-btf.safetensors")
"""The default codec, 32 values, trained on 77 virtual captures.

By `nacre btf capture --all -o captured` and `nacre btf train captured/train/*.npz --half -o FILE`.
"""
