"""PyTorch: one file that imports only torch, with a module that contains its weights."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Mapping

import numpy as np

from nacre.array import Weights
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.compile.trace import FLOAT
from nacre.errors import NacreError
from nacre.targets.program import Function, program
from nacre.targets.target import TABLES, WIDE, Target
from nacre.targets.tensors import Operand, Step, compact, steps
from nacre.targets.text import preamble, shortest

_TABLES = {"dense": ("weights", "biases"), "take": ("table",)}
_BINDING, _WHOLE = {"add": 1, "sub": 1, "mul": 2, "div": 2, "neg": 2}, 9
_LARGEST = float(np.finfo(np.float32).max)
_WIDTH = 88  # characters of weights in a line
_COMPARISONS = "lt", "le", "gt", "ge", "eq", "ne"
_LONGEST = 60  # characters of an expression that is written where it is used

_OPERATIONS: Mapping[str, str] = {
    "add": "{0} + {1}", "sub": "{0} - {1}", "mul": "{0} * {1}", "div": "{0} / {1}", "neg": "-{0}",
    "lt": "{0} < {1}", "le": "{0} <= {1}", "gt": "{0} > {1}", "ge": "{0} >= {1}",
    "eq": "{0} == {1}", "ne": "{0} != {1}", "and": "{0} & {1}", "or": "{0} | {1}",
    "xor": "{0} ^ {1}", "not": "~{0}", "shl": "{0} << {1}", "shr": "{0} >> {1}",
    "min": "torch.minimum({0}, {1})", "max": "torch.maximum({0}, {1})",
    "where": "torch.where({0}, {1}, {2})", "floor": "torch.floor({0})", "abs": "torch.abs({0})",
    "log": "torch.log({0})", "sin": "torch.sin({0})", "cos": "torch.cos({0})",
    "arcsin": "torch.arcsin({0})", "exp": "_exp({0})", "sqrt": "_sqrt({0})",
    "arctan2": "_arctan2({0}, {1})", "truncate": "{0}.long()", "to_float": "{0}.to(wo.dtype)",
    "row": "{0}[{row}]", "stack": "torch.stack([{all}])",
    "take": "torch.take({table}, {0}).to(wo.dtype)", "dense": "_layer({0}, {table})",
}  # fmt: skip
"""Text of each operation on tensors of shape (n,), or (rows, n)."""

_HELPERS = '''\
def _numbers(shape, kind, text):
    """Numbers of a shape from their bytes."""
    data = bytearray(base64.b64decode(text))
    return torch.frombuffer(data, dtype=kind).float().reshape(shape)


def _columns(a, b):
    """The shape that two tensors (..., 3) broadcast to, and both as (3, n)."""
    double = torch.float64 in (a.dtype, b.dtype)
    a, b = torch.broadcast_tensors(a, b)
    rows = (x.movedim(-1, 0).reshape(3, -1) for x in (a, b))
    return a.shape[:-1], *(x.to(torch.float64 if double else torch.float32) for x in rows)


def _above(wi, wo):
    """Whether both directions are above the horizon, and both where they are, else the normal.

    What is not seen is 0, and 0 times a gradient that is infinite is no number.
    """
    visible = (wi[2] > 0.0) & (wo[2] > 0.0)
    up = wi.new_tensor([[0.0], [0.0], [1.0]])
    return visible, torch.where(visible, wi, up), torch.where(visible, wo, up)


def _layer(x, weights, biases):
    x = x if x.dim() == 2 else x[None]  # one row has no dimension of rows
    sums = torch.addmm(biases.to(x.dtype)[:, None], weights.to(x.dtype).mT, x)
    return sums if len(sums) > 1 else sums[0]


# Where a function has no derivative, or an infinite one, these have a finite one.


def _exp(x):
    return torch.exp(x.clamp(max=88.0))


def _sqrt(x):
    return torch.sqrt(x.clamp(min=2.0**-126))


def _arctan2(y, x):
    return torch.arctan2(y, torch.where(x * x + y * y < 2.0**-126, 1.0, x))
'''

_HEADS: Mapping[str, str] = {
    "eval": '''\
    def forward(self, wi, wo):
        """f_r in 1/sr, linear Rec. 709 RGB, shape (..., 3), of directions (..., 3)."""
        shape, wi, wo = _columns(wi, wo)
        visible, wi, wo = _above(wi, wo)''',
    "pdf": '''\
    def pdf(self, wi, wo):
        """Density of wi in 1/sr with which samples are drawn for wo, shape (...)."""
        shape, wi, wo = _columns(wi, wo)
        visible, wi, wo = _above(wi, wo)''',
    "sample": '''\
    def sample(self, wo, u):
        """Directions wi, shape (..., 3), and densities (...), of views and random numbers."""
        shape, wo, u = _columns(wo, u)''',
}
_ENDS: Mapping[str, str] = {
    "eval": "torch.where(visible, {rgb}, 0.0).T.reshape(*shape, 3)",
    "pdf": "torch.where(visible, {pdf}, 0.0).reshape(shape)",
    "sample": "{wi}.T.reshape(*shape, 3), {pdf}.reshape(shape)",
}


class PyTorch(Target):
    title = "PyTorch module in one file, with gradients"
    holds = frozenset({TABLES, WIDE})

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        # A file torch.py or random.py would be imported in place of the library.
        return {f"{name}_brdf.py": _source(self.reflectance(material), name).encode()}


def _source(brdf: Brdf, name: str) -> str:
    store = _Store()
    methods = [_Method(function, store).text() for function in program(brdf).values()]
    title = "".join(part.capitalize() for part in name.split("_"))
    parts = [
        *(f"# {line}".rstrip() for line in preamble(brdf)),
        "\nimport base64\n\nimport torch\n\n",
        f"class {title}Brdf(torch.nn.Module):",  # a class cannot be named None
        '    """A reflectance of tensors (..., 3): float64 where one is, else float32."""\n',
        "    def __init__(self):",
        "        super().__init__()",
        *store.statements,
        *(f"\n{method}" for method in methods),
        f"\n\n{_HELPERS}",
    ]
    return "\n".join(parts)


class _Store:
    """Weights and tables, shared by all methods."""

    def __init__(self) -> None:
        self.statements: list[str] = []
        self._names: dict[tuple[str, bytes], str] = {}

    def name(self, what: str, values: Weights) -> str:
        """The module's name for an array: a parameter, or a constant "table"."""
        key = what, values.tobytes()
        if key not in self._names:
            name = f"{what}_{sum(kind == what for kind, _ in self._names) + 1}"
            self._names[key] = name
            self.statements += _stored(name, values, parameter=what != "table")
        return f"self.{self._names[key]}"


def _stored(name: str, values: Weights, parameter: bool) -> list[str]:
    """Statements that create an array in the module."""
    kept = compact(values)
    encoded = base64.b64encode(kept.tobytes()).decode()
    lines = (encoded[start : start + _WIDTH] for start in range(0, len(encoded), _WIDTH))
    text = "\n".join(f"            {line}" for line in lines)
    made = f'_numbers({values.shape}, torch.{kept.dtype}, """\n{text}\n        """)'
    if parameter:
        return [f"        self.{name} = torch.nn.Parameter({made})"]
    return [f'        self.register_buffer("{name}", {made}, persistent=False)']


class _Method:
    def __init__(self, function: Function, store: _Store) -> None:
        self._function, self._store = function, store
        self._found = steps(function)
        self._texts: list[tuple[str, int]] = []  # with how strongly it binds
        self._statements: list[str] = []

    def text(self) -> str:
        used = Counter(o for step in self._found.steps for o in step.operands if isinstance(o, int))
        results = self._found.results
        used.update([*results.values()] * 2)  # so that results have names
        for place, step in enumerate(self._found.steps):
            text, binding = self._expression(step)
            if step.name not in ("input", "row") and (used[place] > 1 or len(text) > _LONGEST):
                self._statements.append(f"        v{place} = {text}")
                text, binding = f"v{place}", _WHOLE
            self._texts.append((text, binding))
        end = _ENDS[self._function.name].format(
            **{name: self._texts[place][0] for name, place in results.items()}
        )
        head = _HEADS[self._function.name]
        return "\n".join([head, *self._statements, f"        return {end}"])

    def _expression(self, step: Step) -> tuple[str, int]:
        """Text of a step, and how strongly it binds."""
        if step.name == "input":
            return step.parameter, _WHOLE
        template = self._template(step)
        tables = [
            self._store.name(what, table)
            for what, table in zip(_TABLES.get(step.name, ()), step.tables, strict=True)
        ]
        infix, call = template[0] in "{-~", template[0].isalpha() or template[-1] in ")]"
        binding = _BINDING.get(step.name, _WHOLE if call else 0)
        texts = []
        for place, operand in enumerate(step.operands):
            text, own = self._operand(operand, step)
            # With equal binding, the left operand is evaluated first.
            if infix and (own < max(binding, 1) or (place and own == binding != _WHOLE)):
                text = f"({text})"
            texts.append(text)
        text = template.format(*texts, row=step.row, all=", ".join(texts), table=", ".join(tables))
        return text, binding

    def _template(self, step: Step) -> str:
        bound = step.operands[-1] if step.name in ("min", "max") else 0
        if not isinstance(bound, int) and bound.size == 1:
            if step.name == "max" and bound == 0.0 and step.kind == FLOAT:
                return "torch.relu({0})"
            return "{0}.clamp(min={1})" if step.name == "max" else "{0}.clamp(max={1})"
        if step.name not in _OPERATIONS:
            raise NacreError(
                f"PyTorch has no operation {step.name!r}: fit a network first (nacre fit)"
            )
        return _OPERATIONS[step.name]

    def _operand(self, operand: Operand, step: Step) -> tuple[str, int]:
        if isinstance(operand, int):
            return self._texts[operand]
        numbers = [_literal(number) for number in operand]
        if len(numbers) > 1:
            rows = ", ".join(f"[{number}]" for number in numbers)
            return f"wo.new_tensor([{rows}])", _WHOLE
        alone = not any(isinstance(other, int) for other in step.operands[1:])
        # Comparing numbers alone would not give a tensor, which conditions must be.
        constant = step.name in _COMPARISONS and not any(isinstance(o, int) for o in step.operands)
        if constant or (step.name == "where" and alone and step.kind == FLOAT):
            return f"wo.new_tensor({numbers[0]})", _WHOLE  # numbers alone would be float32
        return numbers[0], 0 if numbers[0].startswith("-") else _WHOLE


def _literal(number: np.float32 | np.int32) -> str:
    """A number in its shortest float32 form, unless that rounds beyond the range of PyTorch."""
    text = shortest(number) if isinstance(number, np.float32) else str(int(number))
    return repr(float(number)) if abs(float(text)) > _LARGEST else text
