"""A training of the default codec that is killed while it reads goes on without reading again."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from nacre.btf import TableBtf
from nacre.textures.codecs.basis.codec import BasisCodec
from tests.textures.codecs.basis.test_basis import SMALL, made_texture
from tests.textures.support import run_of

pytest.importorskip("torch", reason="training takes PyTorch")


class Killed(BaseException):
    """What no handler of errors stops."""


@pytest.mark.parametrize("turn", [1, 2], ids=["texels", "coefficients"])
def test_what_has_been_read_is_not_read_again(tmp_path, turn) -> None:
    from nacre.textures.codecs.basis.recipe import BasisRecipe

    recipe = BasisRecipe(
        code_dim=4, luma_count=6, chroma_count=2, width=8, wide=8, hidden=8, completing=8,
        texels=16, coded_texels=16, function_steps=4, code_steps=4,
    )  # fmt: skip
    wi, wo = SMALL.pairs()
    reads: Counter[int] = Counter()
    killing = True

    def opening(seed: int):
        class Counting(TableBtf):
            def texels(self, chosen):
                reads[seed] += 1
                if killing and seed == 3 and reads[seed] == turn:
                    raise Killed
                return super().texels(chosen)

        return lambda: Counting(made_texture(seed, wi, wo).values, wi, wo)

    textures = [opening(seed) for seed in range(5)]
    run = run_of(textures, state=tmp_path / "state")
    with pytest.raises(Killed):
        BasisCodec.train(run, recipe)
    killing = False
    resumed = BasisCodec.train(run, recipe)
    assert reads == {0: 2, 1: 2, 2: 2, 3: 3, 4: 2}
    kept = {path.name for path in tmp_path.iterdir()}
    assert not any("texels-" in name or "coefficients-" in name for name in kept)
    whole = BasisCodec.train(run_of(textures), recipe)
    for one, other in ((resumed.decode, whole.decode), (resumed.complete, whole.complete)):
        np.testing.assert_array_equal(one.linear, other.linear)
    assert set(BasisCodec.state_files(tmp_path / "state")) == set(tmp_path.iterdir())
