"""Little memory: rendering and its libraries say so in a line."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from nacre.io.memory import available_memory
from nacre.mitsuba import llvm
from nacre.mitsuba.engine import DEFAULT_VARIANT, VARIABLE
from tests.tiers import tiered

resource = pytest.importorskip("resource", reason="needs limits of a process")
pytest.importorskip("mitsuba", reason="needs the extra 'render'")

LIMITED = """
import resource, sys
import nacre.mitsuba.preview
from nacre.errors import NacreError
{before}
resource.setrlimit(resource.RLIMIT_AS, ({megabytes} << 20, resource.RLIM_INFINITY))
try:
    {code}
except NacreError as error:
    print(type(error).__name__, error)
"""


def limited(megabytes: int, code: str, before: str = "") -> str:
    """What a process of so little address space prints."""
    if llvm.prepare() is None:
        pytest.skip(f"needs LLVM {llvm.MINIMUM} or newer")
    script = LIMITED.format(before=before, megabytes=megabytes, code=code)
    environment = os.environ | {VARIABLE: DEFAULT_VARIANT}  # a CUDA device wants more addresses
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True, text=True, check=False, timeout=300, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def used() -> int:
    """MiB of address space of a process that has imported what renders."""
    code = "import nacre.mitsuba.preview; print(open('/proc/self/statm').read().split()[0])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return (int(done.stdout) * resource.getpagesize()) >> 20


@pytest.mark.skipif(sys.platform != "linux", reason="needs address space limits that hold")
@pytest.mark.parametrize("left", tiered([40, 90, 200, 400], [200]))
def test_too_little_to_load_mitsuba_is_told(left: int) -> None:
    found = limited(used() + left, "nacre.mitsuba.mitsuba()")
    assert found == "NacreError not enough memory to load mitsuba: raise ulimit -v\n"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="needs address space limits that hold")
def test_too_little_to_render_is_told() -> None:
    found = limited(
        used() + 480, 'nacre.mitsuba.render_preview({"type": "diffuse"}, size=8, spp=1)'
    )
    assert "not enough memory to render" in found


@pytest.mark.skipif(sys.platform != "linux", reason="needs address space limits that hold")
def test_a_picture_that_does_not_fit_is_refused_before_it_is_rendered() -> None:
    code = 'nacre.mitsuba.render_preview({"type": "diffuse"}, size=8192, spp=16)'
    found = limited(3000, code, "nacre.mitsuba.mitsuba()")
    assert "NacreError a picture of 8192 x 8192 pixels takes about" in found
    assert "pixels or fewer" in found


def test_available_memory_is_positive() -> None:
    available = available_memory()
    assert available is None or available > 1 << 20
