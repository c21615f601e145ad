"""The codecs that come with nacre, as methods of experiments."""

from __future__ import annotations

import pytest

from nacre.runtime.progress import silent
from nacre.textures.codecs import PRETRAINED, load_codec
from nacre.textures.codecs.codec_file import codec_fingerprint
from nacre_lab.reproduce.textures.methods import TrainingSettings, find


@pytest.mark.parametrize("name", PRETRAINED)
def test_included_codecs_are_methods_of_experiments(tmp_path, name):
    if name == "unified":
        pytest.importorskip("torch", reason="needs the extra 'btf'")
    codec = find(f"included-{name}-32").train([], TrainingSettings(), tmp_path / "none", silent)
    assert codec_fingerprint(codec) == codec_fingerprint(load_codec(name))
