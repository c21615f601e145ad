"""Functions as nodes of ONNX models.

Values are rows of tensors of shape (rows, n): operations run along the pairs of directions, and
layers are products with a constant matrix on the left.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.compile.trace import FLOAT, INDEX
from nacre.errors import NacreError, require
from nacre.targets.program import Function
from nacre.targets.tensors import Operand, Step, compact, steps
from nacre.targets.text import CONVENTIONS, facts, preamble

_TINY = 2.0**-126
_ROW, _FLAT = np.array([1, -1]), np.array([-1])  # shapes
_OPSET, _FILE_VERSION = 17, 8  # onnxruntime 1.12 and later read them, on every platform

_OPERATORS: Mapping[str, str] = {
    "add": "Add", "sub": "Sub", "mul": "Mul", "div": "Div", "neg": "Neg", "min": "Min",
    "max": "Max", "lt": "Less", "le": "LessOrEqual", "gt": "Greater", "ge": "GreaterOrEqual",
    "eq": "Equal", "and": "And", "or": "Or", "xor": "Xor", "not": "Not", "sqrt": "Sqrt",
    "floor": "Floor", "abs": "Abs", "exp": "Exp", "log": "Log", "sin": "Sin", "cos": "Cos",
    "arcsin": "Asin", "where": "Where",
}  # fmt: skip


class Graph:
    """The nodes and constants of a model; equal computations share one node."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self._onnx: Any = require("onnx", "export")
        self._constants: dict[tuple[Any, ...], Any] = {}
        self._known: dict[tuple[Any, ...], list[str]] = {}

    @property
    def types(self) -> Any:
        """The numbers that stand for types of tensors."""
        return self._onnx.TensorProto

    @property
    def constants(self) -> list[Any]:
        """The initializers."""
        return list(self._constants.values())

    def model(
        self,
        material: Brdf | Btf,
        name: str,
        inputs: Sequence[Any],
        outputs: Sequence[Any],
        further: Sequence[str] = (),
    ) -> bytes:
        """The content of a file with these nodes; `further` lines end its description of the
        material.
        """
        onnx = self._onnx
        model = onnx.helper.make_model(
            onnx.helper.make_graph(self.nodes, name, inputs, outputs, self.constants),
            opset_imports=[onnx.helper.make_opsetid("", _OPSET)],
            ir_version=_FILE_VERSION,
            producer_name="nacre",
            doc_string="\n".join([*preamble(material), *further]),
        )
        known = {**facts(material), "conventions": " ".join(CONVENTIONS)}
        onnx.helper.set_model_props(model, known)
        onnx.checker.check_model(model, full_check=True)
        return bytes(model.SerializeToString(deterministic=True))

    def value(self, name: str, count: int) -> Any:
        """Description of an input or output with shape (n, count), or (n,) for a count of 1."""
        shape = ["n", count] if count > 1 else ["n"]
        return self._onnx.helper.make_tensor_value_info(name, self._onnx.TensorProto.FLOAT, shape)

    def function(self, function: Function) -> list[Any]:
        """Add nodes that compute a function; returns descriptions of its results."""
        found = steps(function)
        tensors: list[str] = []
        for step in found.steps:
            operands = [self._operand(operand, tensors) for operand in step.operands]
            if step.name == "input":
                tensors.append(step.parameter)
            elif step.name == "row":
                tensors.append(self._row(operands[0], found.steps, step))
            else:
                tensors.append(self._step(step, operands))
        for result, place in found.results.items():
            self._result(result, tensors[place], found.steps[place].rows)
        return [self.value(name, found.steps[at].rows) for name, at in found.results.items()]

    def _row(self, tensor: str, known: Sequence[Step], step: Step) -> str:
        """A row of a tensor; in parameters, of shape (n, count), it is a column."""
        (place,) = step.operands
        assert isinstance(place, int)
        if known[place].name != "input":
            return self._nodes("Split", [tensor], known[place].rows, axis=0)[step.row]
        part = self._nodes("Split", [tensor], known[place].rows, axis=1)[step.row]
        return self.node("Reshape", [part, self.constant(_ROW)])

    def _step(self, step: Step, operands: list[str]) -> str:
        name = step.name
        if name == "stack":
            return self.node("Concat", operands, axis=0)
        if name == "dense":
            weights, biases = (self._stored(t) for t in (step.tables[0].T, step.tables[1][:, None]))
            return self.node("Gemm", [weights, *operands, biases])
        if name == "take":
            return self.node("Gather", [self._stored(step.tables[0]), *operands])
        if name in ("truncate", "to_float"):
            return self._cast(operands[0], step.kind)
        if name == "max" and step.kind == FLOAT and _is(step.operands[1], 0.0):
            return self.node("Relu", operands[:1])
        if name == "ne":
            return self.node("Not", [self.node("Equal", operands)])
        if name == "arctan2":
            return self._angle(*operands)
        if name not in _OPERATORS:
            raise NacreError(f"ONNX has no operation {name!r}: fit a network first (nacre fit)")
        return self.node(_OPERATORS[name], operands)

    def _angle(self, y: str, x: str) -> str:
        """arctan2, which ONNX lacks: arctan of the smaller over the larger, moved to its octant."""
        across, along = (self.node("Abs", [each]) for each in (y, x))
        steep = self.node("Greater", [across, along])
        high = self.node("Max", [across, along, self._number(_TINY)])
        ratio = self.node("Div", [self.node("Min", [across, along]), high])
        angle = self.node("Atan", [ratio])
        for turned, total in ((steep, 0.5 * math.pi), (self._below(x), math.pi)):
            rest = self.node("Sub", [self._number(total), angle])
            angle = self.node("Where", [turned, rest, angle])
        return self.node("Where", [self._below(y), self.node("Neg", [angle]), angle])

    def _below(self, tensor: str) -> str:
        return self.node("Less", [tensor, self._number(0.0)])

    def _result(self, name: str, tensor: str, rows: int) -> None:
        if rows > 1:
            self.named("Transpose", [tensor], name, perm=[1, 0])
        else:
            self.named("Reshape", [tensor, self.constant(_FLAT)], name)

    def _operand(self, operand: Operand, tensors: Sequence[str]) -> str:
        if isinstance(operand, int):
            return tensors[operand]
        return self.constant(operand[:, None] if operand.size > 1 else operand.reshape(()))

    def _number(self, value: float) -> str:
        return self.constant(np.array(value, np.float32))

    def _stored(self, values: Weights) -> str:
        """Weights, in half precision if that is exact."""
        kept = compact(values)
        tensor = self.constant(kept)
        return tensor if kept.dtype == np.float32 else self._cast(tensor, FLOAT)

    def constant(self, values: npt.NDArray[Any]) -> str:
        """Name of an initializer with these values."""
        values = np.ascontiguousarray(values).reshape(values.shape)
        key = (values.dtype.str, values.shape, values.tobytes())
        if key not in self._constants:
            name = f"c{len(self._constants)}"
            self._constants[key] = self._onnx.numpy_helper.from_array(values, name)
        return str(self._constants[key].name)

    def _cast(self, tensor: str, kind: str) -> str:
        types = self._onnx.TensorProto
        return self.node("Cast", [tensor], to={FLOAT: types.FLOAT, INDEX: types.INT32}[kind])

    def node(self, operator: str, inputs: Sequence[str], **attributes: Any) -> str:
        return self._nodes(operator, inputs, 1, **attributes)[0]

    def _nodes(
        self, operator: str, inputs: Sequence[str], count: int, **attributes: Any
    ) -> list[str]:
        key = (operator, *inputs, count, str(attributes))
        if key not in self._known:
            first = len(self._known)
            names = [f"t{first}" if count == 1 else f"t{first}_{k}" for k in range(count)]
            self.named(operator, inputs, *names, **attributes)
            self._known[key] = names
        return self._known[key]

    def named(self, operator: str, inputs: Sequence[str], *outputs: str, **attributes: Any) -> None:
        """Add a node whose outputs have these names."""
        self.nodes.append(self._onnx.helper.make_node(operator, inputs, outputs, **attributes))


def _is(operand: Operand, value: float) -> bool:
    """Whether an operand is a constant with this value in all rows."""
    return not isinstance(operand, int) and bool(np.all(operand == value))
