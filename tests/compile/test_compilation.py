"""Compiled functions on disk: found again, by whom they fit, whole whatever happens."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import llvmlite.binding
import numpy as np
import pytest

from nacre.compile.compilation import Compiled, cache_folder, pack

HERE = Path(__file__).parent
DOUBLE = "tests.compile.functions:double"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    cache_folder.cache_clear()
    yield cache_folder(HERE)
    cache_folder.cache_clear()


@pytest.fixture
def compilations(monkeypatch):
    """Kinds of arguments that were compiled for."""
    found, compile_function = [], Compiled._compile
    monkeypatch.setattr(
        Compiled,
        "_compile",
        lambda self, kinds: found.append(kinds) or compile_function(self, kinds),
    )
    return found


def doubled(dtype="float32"):
    x = np.array([1, 2, 3], dtype)
    Compiled(DOUBLE)(x)
    return x.tolist()


def test_a_function_is_compiled_once(folder, compilations):
    assert doubled() == [2, 4, 6]
    assert doubled() == [2, 4, 6]
    assert compilations == [("float32 1C",)]
    assert doubled("int16") == [2, 4, 6]  # of another kind
    assert len(compilations) == len(list(folder.glob("*.o"))) == 2


def test_arguments_are_arrays_and_numbers_of_any_kind(folder):
    add, whole = Compiled("tests.compile.functions:add"), np.zeros((4, 6))
    for part in (whole, whole[1:, ::2], whole[::-1].T, pack(whole)):
        add(part, 2, 0.5, np.float32(2.5), True)
        add(part, np.int8(-1), 100.0, np.float32(2.5), False)
    expected = np.full((4, 6), 2.5)
    expected[0, 1::2] = 2.5
    np.testing.assert_array_equal(whole, expected)
    add(whole, np.int16(-3), 1.0, np.float32(9.0), np.True_)
    np.testing.assert_array_equal(whole, expected - 3.0)


def test_what_needs_numba_in_later_processes_is_refused(folder):
    with pytest.raises(TypeError, match="gamma calls numba_gamma"):
        Compiled("tests.compile.functions:gamma")(np.ones(1))
    assert not list(folder.glob("*.o"))


@pytest.mark.parametrize("content", [b"", b"\0" * 1000, b"half a file"])
def test_damaged_files_are_written_anew(folder, compilations, content):
    doubled()
    (kept,) = folder.glob("*.o")
    kept.write_bytes(content)
    assert doubled() == doubled() == [2, 4, 6]
    assert len(compilations) == 2


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


def test_without_a_folder_functions_are_compiled(monkeypatch, tmp_path, compilations):
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    cache_folder.cache_clear()
    try:
        for _ in range(2):
            assert doubled() == [2, 4, 6]
    finally:
        cache_folder.cache_clear()
    assert len(compilations) == 2


PROCESS = """
import sys
import numpy as np
from nacre.compile.compilation import Compiled
print("ready", flush=True)
sys.stdin.readline()
for kind in sys.argv[1:]:
    x = np.arange(10).astype(kind)
    Compiled("tests.compile.functions:double")(x)
    assert x.sum() == 90
print("numba" in sys.modules)
"""


@pytest.mark.slow
def test_processes_that_compile_at_once_do_not_mix_up_their_files(tmp_path):
    def start(*kinds):
        return subprocess.Popen(
            [sys.executable, "-c", PROCESS, *kinds],
            env={"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    kinds = ["float32", "float64", "int64"]
    processes = [start(kind) for kind in (*kinds, *kinds)]
    for process in processes:
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        process.stdin.write("go\n")
        process.stdin.flush()
    for process in processes:
        process.communicate(timeout=60)
        assert process.returncode == 0
    last = start(*kinds)
    assert last.stdout.readline() == "ready\n"
    assert last.communicate("go\n", timeout=60)[0] == "False\n"  # all are on the disk
    assert last.returncode == 0
    assert len(list(tmp_path.rglob("*.o"))) == len(list(tmp_path.rglob("*-*.*"))) == len(kinds)


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
    assert list(tmp_path.rglob("epoch-*.o"))
    assert output() == fresh
