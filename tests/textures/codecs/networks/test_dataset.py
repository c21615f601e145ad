"""Streams of random texels: which they are, when they come, what is in memory."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")

from nacre.btf import TableBtf
from nacre.errors import FormatError, NacreError
from nacre.textures.codecs.networks.dataset import TexelStream
from nacre.textures.codecs.networks.preprocessing import Whitening
from tests.textures.codecs.networks.made import COARSE, OTHER, load, texture


def numbered(file: int, size: int = 4, directions=COARSE) -> TableBtf:
    """A texture in which value 0 tells the file and the texel."""
    made = texture(file, size, directions)
    made.values[:, :, 0, 0] = 1000.0 * file + np.arange(size * size).reshape(size, size)
    return made


def numbers(batches) -> list[list[int]]:
    return [batch.values[:, 0, 0].astype(int).tolist() for batch in batches]


FILES = [numbered(0), numbered(1), numbered(2, 3)]


def stream(**settings) -> TexelStream:
    defaults = {"batch": 5, "texels": 12, "held_out": 0.125}
    return TexelStream([0, 1, 2], lambda path: FILES[path], **defaults | settings)


def test_an_epoch_draws_so_many_texels_of_every_file_and_each_once():
    made = stream()
    assert made.epoch_steps == (12 + 12 + 8) // 5
    for epoch in range(3):
        drawn = numbers(made.batches(epoch * 6, epoch * 6 + 6))
        flat = [n for batch in drawn for n in batch]
        assert len(set(flat)) == len(flat) == 30
        assert {n // 1000 for n in flat} == {0, 1, 2}
    with_all = stream(held_out=0.0, texels=16, batch=41)
    assert sorted(numbers(with_all.batches(0, 1))[0]) == [
        *range(16),
        *range(1000, 1016),
        *range(2000, 2009),
    ]


def test_epochs_differ_and_the_seed_decides():
    first, second = numbers(stream().batches(0, 6)), numbers(stream().batches(6, 12))
    assert first != second
    assert numbers(stream().batches(0, 6)) == first
    assert numbers(stream(seed=1).batches(0, 6)) != first


def test_held_out_texels_are_never_drawn():
    made = stream()
    held = {int(n) for batch in made.held_out() for n in batch.values[:, 0, 0]}
    assert len(held) == 2 + 2 + 1
    drawn = {n for batch in numbers(made.batches(0, 60)) for n in batch}
    assert len(drawn) == 16 + 16 + 9 - 5
    assert not held & drawn


def test_a_stream_goes_on_anywhere_and_memory_does_not_change_it():
    whole = numbers(stream().batches(0, 20))
    assert numbers(stream().batches(9, 20)) == whole[9:]
    opened = []

    def count(path):
        opened.append(path)
        return FILES[path]

    small = TexelStream([0, 1, 2], count, 5, 12, held_out=0.125, memory=1)
    opened.clear()
    assert numbers(small.batches(0, 20)) == whole
    assert len(opened) > 40  # one batch at a time
    large = TexelStream([0, 1, 2], count, 5, 12, held_out=0.125)
    opened.clear()
    assert numbers(large.batches(0, 20)) == whole
    assert opened == [0, 1, 2] * 4  # epochs


def test_memory_is_bounded():
    size = 5 * 225 * 12
    alive = []

    class Watched(TexelStream):
        def _read(self, plan):
            batches = super()._read(plan)
            alive.append(sum(batch.values.nbytes for batch in batches))
            return batches

    made = Watched([0, 1, 2], lambda path: FILES[path], 5, 12, memory=4 * size)
    for _ in made.batches(0, 20):
        assert sum(alive[-2:]) <= 4 * size
    assert sum(alive) == 20 * size


def test_processes_share_every_batch():
    whole = numbers(stream(batch=6).batches(0, 10))
    parts = [numbers(stream(batch=6, rank=rank, size=2).batches(0, 10)) for rank in (0, 1)]
    assert [[*a, *b] for a, b in zip(*parts, strict=True)] == whole
    with pytest.raises(NacreError, match="cannot be shared by 4"):
        stream(batch=6, size=4)


def test_a_batch_has_texels_of_one_set_of_directions():
    files = [numbered(0), numbered(1, 4, OTHER), numbered(2)]
    made = TexelStream([0, 1, 2], lambda path: files[path], 4, 12, held_out=0.1)
    assert [len(wi) for wi, _ in made.directions] == [225, 100]
    assert made.epoch_steps == 6 + 3
    seen = []
    for batch in made.batches(0, 9):
        (group,) = {n // 1000 == 1 for n in batch.values[:, 0, 0].astype(int)}
        assert batch.values.shape == (4, 100 if group else 225, 3)
        assert batch.group == group
        seen.append(group)
    assert sum(seen) == 3


def test_few_texels_fill_a_batch_several_times():
    made = TexelStream([2], lambda path: FILES[path], 20, 5, held_out=0.0)
    (batch,) = numbers(made.batches(0, 1))
    assert len(batch) == 20
    assert len(set(batch)) == 5


def test_what_cannot_be_trained_on_is_refused(tmp_path):
    with pytest.raises(NacreError, match="no file"):
        TexelStream([], load, 4, 12)
    bad = tmp_path / "bad.npz"
    bad.write_bytes(b"nothing")
    with pytest.raises(FormatError, match=r"bad\.npz"):
        TexelStream([bad], load, 4, 12)
    hole = texture(0)
    hole.values[:, :, 7] = np.nan
    made = TexelStream(["hole.btf"], lambda path: hole, 4, 12)
    with pytest.raises(FormatError, match=r"hole\.btf: .* not finite"):
        next(made.batches(0, 1))


def test_whitened_training_data_have_mean_0_and_deviation_1():
    made = stream(held_out=0.0)
    whitening = Whitening.of(made.sample())
    values = np.concatenate([part.ravel() for part in made.sample()])
    whitened = whitening.whiten(values)
    assert whitened.mean() == pytest.approx(0.0, abs=1e-4)
    assert whitened.std() == pytest.approx(1.0, abs=1e-4)
    assert whitening.mean == pytest.approx(float(np.log(values + 0.01).mean()), abs=1e-5)


def test_only_the_entries_that_a_batch_needs_are_read():
    def entries(step, count):
        return None if step == 2 else np.array([0, 1 + step, count - 1])

    whole = list(stream().batches(0, 8))
    some = list(stream(entries=entries).batches(0, 8))
    count = FILES[0].pair_count
    for step, (all_of_it, part) in enumerate(zip(whole, some, strict=True)):
        needed = entries(step, count)
        if needed is None:
            assert part.entries is None
            needed = np.arange(count)
        else:
            np.testing.assert_array_equal(part.entries, needed)
        np.testing.assert_array_equal(part.values, all_of_it.values[:, needed])
