"""What is written of a material: identifiers, preambles, and statements."""

from __future__ import annotations

import operator
import re
from functools import lru_cache

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.measured.mbsdf_table import Resolution
from nacre.measured.mbsdf_writer import tabulate
from nacre.neural import NeuralBrdf
from nacre.neural.training import initial_layers
from nacre.targets import TARGETS, Function, export, identifier, preamble, program, safe
from nacre.targets.source import Language
from nacre.workflows.places import PLACES
from tests.analytic.materials import closures
from tests.cli.support import assert_refused, run, run_json
from tests.oracles.materials import material
from tests.tiers import tiered

HOSTILE = (
    '*/ system("rm -rf /") /*',
    "a\nb\r\u2028c",
    "ends with \\",
    "trigraph ??/",
    "]]> --> <script>",
    '""" + import os',
    "\x00\x1b[31m",
    "${x} `y` {0}",
)

COMMENTS = {"brdf": b"#", "pytorch": b"#", "materialx": (b"//", b"  <!-- ")}
COMMENTS["materialx-closures"] = COMMENTS["materialx"]
"""What begins a comment, where it is not //."""


@pytest.mark.parametrize("text", HOSTILE)
def test_text_of_a_file_stays_within_a_comment(text: str) -> None:
    kept = safe(text)
    assert kept.isascii()
    assert kept.isprintable()
    assert not set(kept) & set("*/\\\"'<>`{}$?#&[]|\n\r")
    assert "--" not in kept


@pytest.mark.parametrize("text", [*HOSTILE, "", "9 lives", "gl_color", "__a__b__", "çédille", "漆"])
def test_every_name_becomes_an_identifier(text: str) -> None:
    assert re.fullmatch(r"(?!gl_)[a-z](_?[a-z0-9])*", identifier(text))
    assert identifier(identifier(text)) == identifier(text)


def test_an_identifier_is_of_a_length_that_compilers_take():
    assert len(identifier("x" * 10_000)) <= 60


BINARY = "onnx", "npy", "h5"
"""Targets that are no text."""
CLOSURES = "osl-closures", "materialx-closures"
"""Of those that fit a material first; others have the name as data (see test_blender.py)."""
TEXTS = [
    name
    for name, kind in TARGETS.members()
    if name in CLOSURES or not (name in BINARY or kind.model)
]


@lru_cache
def exported(target: str, name: str) -> dict[str, bytes]:
    """What a target writes of a material of some name."""
    held = MODELS["closures"](**closures()) if target in CLOSURES else material("glossy")
    if target == "mdl":  # which would make a whole table of it for each name
        held = tabulate(held, Resolution(8, 8))
    return TARGETS[target]().files(held.replaced(name=name, source={"terms": name}), "same")


@pytest.mark.parametrize("target", TEXTS)
@pytest.mark.parametrize("text", tiered(HOSTILE, list(HOSTILE)[:2]))
def test_nothing_of_a_name_is_code(target: str, text: str) -> None:
    """The output differs from that of a harmless name in comments only."""
    hostile, harmless = exported(target, text), exported(target, "harmless")
    assert list(hostile) == list(harmless)
    for file, content in hostile.items():
        pairs = zip(content.split(b"\n"), harmless[file].split(b"\n"), strict=True)
        changed = [line for line, other in pairs if line != other]
        comment = COMMENTS.get(target, b"//")
        assert all(line.startswith(comment) and b"*/" not in line for line in changed)


def test_a_preamble_says_what_is_known_of_a_material():
    fitted = material("glossy")
    lines = "\n".join(preamble(fitted.replaced(source={"terms": "CC0"})))
    assert "glossy; written by nacre export" in lines
    assert "675 weights, 1350 memory bytes" in lines
    assert f"held-out loss {fitted.metadata['quality']['held_out_loss']:.5f}" in lines
    assert "Terms of the source: CC0" in lines


def evaluated(function: Function, *given: np.ndarray) -> dict[str, np.ndarray]:
    """A function's operations, one after the other, in double precision."""
    inputs = np.concatenate([np.atleast_2d(x).astype(np.float64) for x in given], axis=1)
    values: dict[int, object] = {}
    plain = {
        "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide,
        "neg": np.negative, "min": np.minimum, "max": np.maximum, "where": np.where,
        "lt": np.less, "le": np.less_equal, "gt": np.greater, "ge": np.greater_equal,
        "and": np.logical_and, "or": np.logical_or, "not": np.logical_not,
    }  # fmt: skip
    with np.errstate(all="ignore"):
        for number, (_, name, *arguments) in function.operations.items():
            constant = function.number(number)
            if name == "input":
                values[number] = inputs[:, arguments[0]]
            elif constant is not None:
                values[number] = constant
            elif name == "dense":
                weights, biases, rows, sources = arguments
                stacked = np.stack([np.broadcast_to(values[s], len(inputs)) for s in sources], 1)
                matrix = function.tables[weights].reshape(len(sources), rows)
                values[number] = stacked @ matrix + function.tables[biases]
            elif name == "output":
                values[number] = values[arguments[0]][:, arguments[1]]
            else:
                operation = plain.get(name) or getattr(np, name)
                values[number] = operation(*(values[a] for a in arguments))
    return {
        name: np.stack([np.broadcast_to(values[v], len(inputs)) for v in numbers], -1)
        for name, numbers in function.results.items()
    }


@pytest.mark.parametrize("name", ["glossy", "anisotropic", "physical", "ggx"])
def test_a_program_computes_what_the_material_does(name: str) -> None:
    brdf, random = material(name), np.random.default_rng(0)
    wi, wo = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in random.normal(size=(2, 500, 3)))
    wi[:, 2], wo[:, 2] = abs(wi[:, 2]), abs(wo[:, 2])
    u = random.random((500, 3))
    functions = program(brdf)
    np.testing.assert_allclose(
        evaluated(functions["eval"], wi, wo)["rgb"], brdf.eval(wi, wo), rtol=1e-5, atol=1e-7
    )
    np.testing.assert_allclose(
        evaluated(functions["pdf"], wi, wo)["pdf"][:, 0], brdf.pdf(wi, wo), rtol=1e-5, atol=1e-7
    )
    drawn = evaluated(functions["sample"], wo, u)
    directions, density = brdf.sample(wo, u)
    np.testing.assert_allclose(drawn["wi"], directions, atol=1e-5)
    np.testing.assert_allclose(drawn["pdf"][:, 0], density, rtol=1e-3, atol=1e-6)


def test_units_that_never_act_are_left_out():
    layers = initial_layers((8, 8), 0)
    layers[0].biases[2] = -1e3
    sizes = [
        op[4] for op in program(NeuralBrdf(layers))["eval"].operations.values() if op[1] == "dense"
    ]
    assert sizes[0] < 8


@pytest.mark.parametrize("value", [0.1, -1e-30, 1.0, 3.4028235e38, 1 / 3, 12345678.0, 1e-40])
@pytest.mark.parametrize("legacy", [False, "1.13"])  # a library may have NumPy print fewer digits
def test_literals_are_the_same_numbers(value: float, legacy: str | bool) -> None:
    with np.printoptions(legacy=legacy):
        text = Language().literal(value)
    assert np.float32(float(text)) == np.float32(value)
    assert any(c in text for c in ".e")


class _Plain(Language):
    vectors = ""

    def component(self, vector: str, index: int) -> str:
        return vector


@pytest.mark.parametrize(
    "formula",
    [
        lambda a, b: -(a + b),
        lambda a, b: operator.neg(-(a * b)),
        lambda a, b: a - (-(a - b)),
        lambda a, b: -a * b / (a / b),
        lambda a, b: a - (b - a) - (a + b),
        lambda a, b: a / (b * a) * (a - -2.5),
    ],
)
def test_parentheses_keep_the_order_of_operations(formula) -> None:
    of_two = {"a": 1, "b": 1}
    function = Function.of("f", lambda a, b: (formula(a[0], b[0]),), of_two, ["result"])
    text = re.search(r"return (.*);", _Plain().function(function, "f"))
    assert text
    # Python reads these operators as the languages do.
    assert eval(text[1], {"a": 1.25, "b": -0.375}) == formula(1.25, -0.375)


def test_a_table_is_refused_with_what_to_do() -> None:
    class Opaque(Brdf):
        def eval_components(self, wi, wo):
            return tuple(np.maximum.accumulate(x) for x in wi)

    with pytest.raises(NacreError, match=r"fit a network to it first \(nacre fit\)"):
        export(Opaque(name="felt"), "glsl")


def test_the_command_writes_files_and_protects_those_of_others(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    nacre.save(material("glossy"), tmp_path / "9 gloss.safetensors")
    assert run("export", "9 gloss.safetensors", "--to", "glsl") == 0
    text = (tmp_path / "m_9_gloss.glsl").read_text()
    assert "vec3 m_9_gloss_eval(vec3 wi, vec3 wo) {" in text
    assert run("export", "9 gloss.safetensors", "--to", "glsl", "--name", "gold") == 0
    assert "float gold_pdf(" in (tmp_path / "gold.glsl").read_text()
    found = run_json(capsys, "export", "9 gloss.safetensors", "--to", "wgsl", "-o", "into/")
    assert [each["output"] for each in found["files"]] == ["into/m_9_gloss.wgsl"]
    with (tmp_path / "gold.glsl").open("a") as file:
        file.write("// mine")
    again = "export", "9 gloss.safetensors", "--to", "glsl", "-o", "gold.glsl"
    assert_refused(capsys, "was changed since nacre wrote it", *again)
    assert_refused(
        capsys, "is no known target or place", "export", "9 gloss.safetensors", "--to", "x"
    )
    assert_refused(capsys, "expected an INPUT and --to TARGET", "export", "9 gloss.safetensors")
    (tmp_path / "cut.safetensors").write_bytes(b"\x90\x00")
    assert_refused(capsys, "cut.safetensors", "export", "cut.safetensors", "--to", "glsl")


def test_targets_are_listed(capsys):
    found = run_json(capsys, "export", "--list")
    assert [each["target"] for each in found if "target" in each] == list(TARGETS)
    assert [each["place"] for each in found if "place" in each] == list(PLACES)
    assert all(each["title"] for each in found)
