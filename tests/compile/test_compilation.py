"""Compiled functions on disk: found again, by whom they fit, whole whatever happens."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import llvmlite.binding
import pytest

from nacre.compile.compilation import cache_folder, compiled

HERE = Path(__file__).parent


def double(x):
    return x + x


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    cache_folder.cache_clear()
    yield cache_folder(HERE)
    cache_folder.cache_clear()


def hits(dispatcher):
    return sum(dispatcher.stats.cache_hits.values())


def test_a_function_is_compiled_once(folder):
    first, second = compiled(double), compiled(double)
    assert (first(2), hits(first)) == (4, 0)
    assert (second(2), hits(second)) == (4, 1)
    assert (second(0.5), hits(second)) == (1.0, 1)  # another signature


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("content", [b"", b"\0" * 1000, b"half a file"])
def test_damaged_files_are_written_anew(folder, ending, content):
    compiled(double)(2)
    (damaged,) = folder.glob(f"*.{ending}")
    damaged.write_bytes(content)
    after, later = compiled(double), compiled(double)
    assert (after(2), hits(after)) == (4, 0)
    assert (later(2), hits(later)) == (4, 1)


def test_every_processor_has_a_folder(folder, monkeypatch):
    for name, value in (
        ("get_host_cpu_name", "abacus"),
        ("get_host_cpu_features", llvmlite.binding.FeatureMap(beads=True)),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(llvmlite.binding, name, lambda value=value: value)
            cache_folder.cache_clear()
            assert cache_folder(HERE) != folder
    cache_folder.cache_clear()
    assert cache_folder(HERE) == folder


def test_every_state_of_the_source_has_a_folder(folder, tmp_path):
    folders = []
    for text in ("", "a = 1", "a = 2"):
        (tmp_path / "simd.py").write_text(text)
        cache_folder.cache_clear()
        folders.append(cache_folder(tmp_path))
    assert len({folder, *folders}) == 4


def test_without_a_folder_functions_are_compiled(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    cache_folder.cache_clear()
    try:
        for _ in range(2):
            dispatcher = compiled(double)
            assert (dispatcher(2), hits(dispatcher)) == (4, 0)
    finally:
        cache_folder.cache_clear()


PROCESS = """
import sys
import time
import numpy as np
from numba.core.caching import IndexDataCacheFile
from nacre.compile.compilation import compiled

load = IndexDataCacheFile._load_index

def slow(self):
    found = load(self)
    time.sleep(0.2)
    return found

IndexDataCacheFile._load_index = slow  # so that the others come in between

def total(x):
    return x.sum()

dispatcher = compiled(total)
print("ready", flush=True)
sys.stdin.readline()
for kind in sys.argv[1:]:
    assert dispatcher(np.arange(10).astype(kind)) == 45
print(sum(dispatcher.stats.cache_hits.values()))
"""


@pytest.mark.slow
def test_processes_that_compile_at_once_do_not_mix_up_their_files(tmp_path):
    script = tmp_path / "process.py"
    script.write_text(PROCESS)

    def start(*kinds):
        return subprocess.Popen(
            [sys.executable, script, *kinds],
            env={"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    kinds = ["float32", "float64", "int64"]
    processes = [start(kind) for kind in kinds]
    for process in processes:
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        process.stdin.write("go\n")
        process.stdin.flush()
    for process in processes:
        process.communicate(timeout=60)
        assert process.returncode == 0
    last = start(*kinds)
    assert last.communicate("go\n", timeout=60)[0].split()[-1] == str(len(kinds))
    assert last.returncode == 0
    assert len(list(tmp_path.rglob("*.nbc"))) == len(kinds)


TRAINING = """
import numpy as np
from nacre.neural.kernel import KernelTrainer
from nacre.neural.samples import Samples
from nacre.neural.training import initial_layers

random = np.random.default_rng(0)
samples = Samples.pack(
    random.normal(size=(800, 6)), random.uniform(size=(800, 3)), random.uniform(size=800)
)
trainer = KernelTrainer(initial_layers((21, 21), 0), 512)
for _ in range(3):
    order = random.permutation(samples.block_count)
    trainer.epoch(samples, order, np.full(2, 5e-3, np.float32))
    print(trainer.loss(samples).hex(), trainer.gradient(samples, order[:9])[0].hex())
print([layer.weights.tobytes().hex() for layer in trainer.layers()])
"""


@pytest.mark.slow
def test_freshly_compiled_code_rounds_as_code_from_the_disk(tmp_path):
    def output():
        return subprocess.run(
            [sys.executable, "-c", TRAINING],
            env={"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout

    fresh = output()
    assert list(tmp_path.rglob("*.nbc"))
    assert output() == fresh
