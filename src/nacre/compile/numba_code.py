"""Python functions that become machine code: what marks them, and how Numba compiles them.

Only modules of such functions import this one, and they are imported only to compile:
:class:`nacre.compile.compilation.Compiled` calls the code that is kept on disk.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import _FunctionCompiler  # type: ignore[attr-defined]

# Inlined, for a symbol of its own would be looked up in whatever this process has compiled so far:
# code with other roundings than what the next process loads from the disk.
inner = numba.njit(error_model="numpy", forceinline=True, _nrt=False)
"""A function that becomes part of the compiled functions that call it."""
inner_fast = numba.njit(error_model="numpy", fastmath=True, forceinline=True, _nrt=False)
"""One that may also reorder sums and takes all numbers to be finite."""
compiled: Callable[[Callable[..., Any]], Any] = inner
"""A function that :class:`nacre.compile.compilation.Compiled` calls: it writes to arrays that it is
given, makes none, and returns nothing. Compiled functions that it calls become part of it; they
must lie in the same folder."""

_WORD = ir.IntType(64)


class _Compiler(_FunctionCompiler):  # type: ignore[misc]
    """Without the functions by which Python would call the code, and without loading it here."""

    def _customize_flags(self, flags: Flags) -> Flags:
        flags.no_cpython_wrapper = flags.no_cfunc_wrapper = flags.no_compile = True
        return flags


@global_compiler_lock  # type: ignore[untyped-decorator]
def object_code(function: Any, kinds: Sequence[str]) -> bytes:
    """The object file of a function, marked by :data:`compiled`, for kinds of arguments.

    Its function `run` takes them as :func:`nacre.compile.compilation.pack` lays them out, and
    returns 0 unless something failed.

    Raises TypeError if the function needs Numba's own library, and Numba's errors if it does not
    compile, as one that makes an array.
    """
    options = function.targetdescr, function.targetoptions, function.locals
    compiler = _Compiler(function.py_func, *options, pipeline_class=Compiler)
    result = compiler.compile(tuple(map(_type, kinds)), types.none)
    library = result.library
    library.add_ir_module(_entry(library, result))
    library.enable_object_caching()
    library.finalize()
    needed = [f.name for f in library._final_module.functions if f.is_declaration]
    if missing := [name for name in needed if not name.startswith("llvm.")]:
        raise TypeError(f"{function.__name__} calls {', '.join(missing)}")
    library.get_pointer_to_function("run")  # which makes the machine code
    code: bytes = library._get_compiled_object()
    return code


def _entry(library: Any, result: Any) -> ir.Module:
    """The function `run`, which reads arguments from words of 64 bits."""
    made, described = library.create_ir_module("run"), result.fndesc
    convention = result.target_context.call_conv
    kind = convention.get_function_type(described.restype, described.argtypes)
    inside = ir.Function(made, kind, described.llvm_func_name)
    run = ir.Function(made, ir.FunctionType(ir.IntType(32), [_WORD.as_pointer()]), "run")
    builder = ir.IRBuilder(run.append_basic_block("entry"))
    arguments = [builder.alloca(pointer.pointee) for pointer in kind.args[:2]]
    for index, argument in enumerate(kind.args[2:]):
        word = builder.gep(run.args[0], [_WORD(index)])
        if isinstance(argument, ir.PointerType):
            arguments.append(builder.inttoptr(builder.load(word), argument))
        else:
            arguments.append(builder.load(builder.bitcast(word, argument.as_pointer())))
    builder.ret(builder.call(inside, arguments))
    return made


def _type(kind: str) -> Any:
    """Numba's type of a kind of argument."""
    dtype, _, shape = kind.partition(" ")
    scalar = numba.from_dtype(np.dtype(dtype))
    return types.Array(scalar, int(shape[:-1]), shape[-1]) if shape else scalar
