"""Instruction sets that this processor has, and how to have a process use no more than one of them.

A process is told by variables of NumPy, PyTorch, OpenBLAS, MKL and oneDNN, by what LLVM says of the
processor, which nacre and Numba compile for, and by the target of Dr.Jit. Nothing of nacre may be
imported before :func:`take_for`.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import llvmlite.binding as llvm
from numpy._core._multiarray_umath import (  # type: ignore[attr-defined]
    __cpu_dispatch__ as dispatched,
)
from numpy._core._multiarray_umath import (  # type: ignore[attr-defined]
    __cpu_features__ as features,
)

WIDE = ("AVX512", "X86_V4")
"""What NumPy's names of features of 16 lanes start with."""

_ROOT = Path(__file__).parents[2]
_AVX512 = ("avx512", "evex512")
_AVX = ("avx", "evex", "vaes", "vpcl", "f16c", "fma", "xop")


@dataclass(frozen=True)
class Processor:
    """One whose vectors have so many lanes of float32.

    Parameters
    ----------
    needs
        Name of LLVM's for what this processor must have.
    name
        LLVM's, of the processor to take this one for.
    lanes
        Of a vector register.
    off
        What features start with that are taken not to be there.
    capability, core, instructions, isa
        As PyTorch, OpenBLAS, MKL and oneDNN call it.
    """

    needs: str
    name: str
    lanes: int
    off: tuple[str, ...]
    capability: str
    core: str
    instructions: str
    isa: str

    @property
    def missing(self) -> str:
        """Why this machine cannot run it; empty where it can."""
        return "" if llvm.get_host_cpu_features().get(self.needs) else f"needs {self.needs}"

    def environment(self) -> dict[str, str]:
        """Variables of a process."""
        off = [
            name
            for name in dispatched
            if features[name] and (self.lanes == 4 or (self.lanes == 8 and name.startswith(WIDE)))
        ]
        return {
            "NPY_DISABLE_CPU_FEATURES": " ".join(off),
            "ATEN_CPU_CAPABILITY": self.capability,
            "OPENBLAS_CORETYPE": self.core,
            "MKL_ENABLE_INSTRUCTIONS": self.instructions,
            "ONEDNN_MAX_CPU_ISA": self.isa,
        }


PROCESSORS: dict[str, Processor] = {
    "AVX-512": Processor(
        "avx512f", "x86-64-v4", 16, (), "avx512", "SkylakeX", "AVX512", "AVX512_CORE"
    ),
    "AVX2": Processor("avx2", "x86-64-v3", 8, _AVX512, "avx2", "Haswell", "AVX2", "AVX2"),
    "SSE": Processor("sse4.2", "x86-64-v2", 4, _AVX, "default", "Nehalem", "SSE4_2", "SSE41"),
}
"""By the name of the instructions."""


def take_for(processor: Processor) -> None:
    """Have LLVM say that this machine has that processor."""
    found = llvm.get_host_cpu_features()
    found.update({name: False for name in found if name.startswith(processor.off or "-")})
    llvm.get_host_cpu_features = lambda: found
    llvm.get_host_cpu_name = lambda: processor.name


def target_drjit(processor: Processor) -> int:
    """Have Dr.Jit, whose LLVM is loaded, compile for the lanes of a processor; those it then has.

    It needs the instructions of AVX2 beside: without them fused products become calls that it does
    not link. There is no function of Python for it: this calls those of its library.
    """
    import drjit

    (library,) = Path(drjit.__file__).parent.glob("libdrjit-core.*")
    core = ctypes.CDLL(str(library))
    name = "x86-64-v3" if processor.lanes == 4 else processor.name
    core._Z19jit_llvm_set_targetPKcS0_j(name.encode(), b"", processor.lanes)
    lanes: int = core._Z21jit_llvm_vector_widthv()
    return lanes


def run(
    name: str,
    source: Path,
    target: Path,
    parts: tuple[str, ...],
    others: Mapping[str, str],
    alone: bool = False,
) -> None:
    """Have a process write what it makes of the objects of a file; see :mod:`.process`.

    It has further variables, and is held to one core if it is to be alone.
    """
    environment = {**os.environ, **PROCESSORS[name].environment(), **others}
    environment["PYTHONPATH"] = os.pathsep.join([str(_ROOT / "src"), str(_ROOT)])
    command = ["taskset", "-c", "0"] if alone else []
    command += [sys.executable, "-m", "tests.contracts.process", name, str(source), str(target)]
    done = subprocess.run(
        [*command, *parts], env=environment, cwd=_ROOT, capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"{name}: {done.stderr[-2000:]}")
