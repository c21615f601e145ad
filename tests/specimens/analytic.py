"""Analytic materials as JSON, and published tables of fitted parameters with one material."""

from __future__ import annotations

import json
from collections.abc import Iterable
from random import Random
from typing import Any

from nacre.analytic import MODELS
from tests.analytic.materials import EXAMPLES
from tests.specimens.specimen import NUMBERS, VALUES, Specimen, odd_json


def _content(model: str) -> dict[str, Any]:
    return {
        "model": model,
        "version": 1,
        "name": "paint",
        "parameters": EXAMPLES[model].values,
        "metadata": {"fit": {"samples": 3}, "source": {"file": "a", "sha256": "b"}},
    }


def _json_file(content: Any) -> bytes:
    return json.dumps(content).encode()


def _json_valued(value: float) -> Iterable[bytes]:
    for model, example in EXAMPLES.items():
        many = MODELS[model].fitted_on == "pictures"
        for name, old in list(example.values.items())[:: 4 if many else 1]:
            new = value if isinstance(old, float) else [*old[:2], value]
            yield _json_file(_content(model) | {"parameters": {**example.values, name: new}})


def _json_rebuilt(_: bytes, random: Random) -> bytes:
    model = random.choice(list(MODELS))
    content = _content(model)
    values = content["parameters"] = dict(content["parameters"])
    for parameter in MODELS[model].parameters:
        if random.random() < 0.5:
            low, high = parameter.low, parameter.high
            share = random.choice((0.0, 1.0, random.random(), 1e-9))
            number = low + (high - low) * share
            values[parameter.name] = [number] * 3 if parameter.color else number
    choice = random.random()
    if choice < 0.2:
        values[random.choice([*values, "name"])] = odd_json(random)
    elif choice < 0.3:
        content[random.choice(list(content))] = odd_json(random)
    elif choice < 0.4:
        place = random.choice(("fit", "source"))
        content["metadata"][place] |= {random.choice(("file", "epochs")): odd_json(random)}
    return _json_file(content if random.random() < 0.97 else odd_json(random))


# Tables of fits

_TABLE = {
    "NganBlinnPhong": {"albedo": "[0.1, 0.2, 0.1]", "sharpness": "60.0"},
    "NganLafortune": {
        "albedo": "[0.1, 0.2, 0.1]",
        "Cxy": "-0.6",
        "Cz": "0.6",
        "sharpness": "20.0",
    },
    "NganWard": {"albedo": "[0.1, 0.2, 0.1]", "roughness": "0.2"},
    "NganAshikhminShirley": {
        "albedo": "[0.1, 0.2, 0.1]",
        "fresnelReflectance": "0.1",
        "sharpness": "60.0",
    },
    "LowCookTorrance": {"albedo": "[0.1, 0.2, 0.1]", "roughness": "0.2", "eta": "1.5"},
    "LowMicrofacetFit": {"A": "[5.0, 3.0, 2.0]", "B": "500.0", "C": "1.3", "eta": "1.6"},
    "Bagher": {
        "albedo": "[0.1, 0.2, 0.1]",
        "alpha": "[0.05, 0.05, 0.05]",
        "p": "[0.7, 0.7, 0.7]",
        "eta": "[[0.2, 0.2, 0.2], [0.1, 0.1, 0.1]]",
        "K": "[8.0, 8.0, 8.0]",
        "Lambda": "[2.0, 2.0, 2.0]",
        "c": "[0.1, 0.1, 0.1]",
        "k": "[6.0, 6.0, 6.0]",
        "theta0": "[0.1, 0.1, 0.1]",
    },
}


def _fit_file(model: str = "NganWard", **changed: str) -> bytes:
    values = _TABLE[model] | changed
    diffuse = values.pop("diffuse", "[0.1, 0.2, 0.3]")
    given = ", ".join(f"{name} = {value}" for name, value in values.items())
    formula = f"Aggregate(Lambertian(albedo = {diffuse}), {model}({given}))"
    return f"# BSDF fits\npaint = {formula}\n".encode()


def _literal(value: float) -> str:
    return {"inf": "1e999", "-inf": "-1e999"}.get(str(value), str(value))


def _fit_valued(value: float) -> Iterable[bytes]:
    for model, values in _TABLE.items():
        for name, old in values.items():
            new = _literal(value)
            if old.startswith("[["):
                new = f"[[0.2, 0.2, {new}], [0.1, 0.1, 0.1]]"
            elif old.startswith("["):
                new = f"[0.1, {new}, 0.1]"
            yield _fit_file(model, **{name: new})


def _fit_rebuilt(_: bytes, random: Random) -> bytes:
    words = [_literal(n) for n in (*NUMBERS, *VALUES)]
    words += ["[1, 2, 3]", "[1, 2]", "[[1]]", "'x'", "None", "1j", "1 + 2j", "{}", "x()", "(1,)"]
    words += ["-" * random.choice((50, 3000)) + "1", "(" * random.choice((50, 3000)) + "1"]
    words += ["[" * 90 + "]" * 90, "9" * random.choice((400, 5000)), "1_0", "0x10", "b'x'", "\0"]
    words += ["f'{x}'", "*x", "lambda: 1", "1 if 1 else 2", "\\", "#", "'\\ud800'", "1:=2"]
    model = random.choice(list(_TABLE))
    changed = {
        random.choice([*_TABLE[model], "diffuse", "name", "metadata"]): random.choice(words)
        for _ in range(random.randint(0, 3))
    }
    data = _fit_file(model, **changed)
    return data * 2 if random.random() < 0.05 else data


SPECIMENS = {
    "analytic": Specimen(
        "paint.json",
        lambda: [_json_file(_content(model)) for model in ("ggx", "sgd", "ggx-anisotropic")],
        header=100,
        sized=lambda count: [_json_file(_content("ggx") | {"version": count})],
        valued=_json_valued,
        rebuild=_json_rebuilt,
        text=True,
    ),
    "table of fits": Specimen(
        "paint.fit",
        lambda: [_fit_file(model) for model in _TABLE],
        header=100,
        sized=lambda _: [],
        valued=_fit_valued,
        rebuild=_fit_rebuilt,
        text=True,
    ),
}
