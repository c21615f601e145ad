"""JSON files and published tables: exact round trips, and bad input."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import nacre
from nacre.analytic import MODELS, Ggx
from nacre.analytic.tables import materials
from nacre.errors import FormatError
from tests.analytic.materials import EXAMPLES
from tests.data import require_data
from tests.measured.support import hemisphere

LINE = (
    "steel = Aggregate(Lambertian(albedo = [0.1, 0.2, 0.3]), "
    "NganWard(albedo = [0.3, 0.2, 0.1], roughness = 0.25))"
)

NGAN_AND_LOW = "ngan_cooktorrance", "low_cooktorrance_E2"


@pytest.mark.parametrize("name", MODELS)
def test_files_come_back_as_they_were(name, tmp_path):
    nacre.save(EXAMPLES[name], tmp_path / "one.json")
    loaded = nacre.load(tmp_path / "one.json")
    assert type(loaded) is MODELS[name]
    assert (loaded.values, loaded.name) == (EXAMPLES[name].values, name)
    nacre.save(loaded, tmp_path / "two.json")
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()


@given(st.lists(st.floats(0, 1), min_size=7, max_size=7))
def test_every_number_survives(tmp_path_factory, numbers):
    brdf = Ggx(diffuse=numbers[:3], specular=numbers[3:6], roughness=max(1e-3, numbers[6]))
    path = tmp_path_factory.mktemp("ggx") / "x.json"
    nacre.save(brdf, path)
    assert nacre.load(path).values == brdf.values


def test_only_analytic_materials_are_written(tmp_path):
    network = nacre.neural.NeuralBrdf([nacre.neural.Layer(np.ones((6, 3)), np.ones(3))])
    with pytest.raises(FormatError, match="analytic materials only"):
        nacre.save(network, tmp_path / "x.json")
    assert not list(tmp_path.iterdir())


CONTENT = {"model": "ggx", "parameters": EXAMPLES["ggx"].values}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({**CONTENT, "model": "gxx"}, "'gxx' is no known analytic model; did you mean ggx"),
        ({**CONTENT, "model": 3}, "field 'model' is not a string"),
        ({**CONTENT, "model": "x" * 2000}, "known: lambert"),
        ({**CONTENT, "version": [9] * 2000}, "update nacre"),
        ({**CONTENT, "parameters": {"x" * 2000: 1}}, "ggx lacks"),
        (
            {**CONTENT, "parameters": CONTENT["parameters"] | {"roughness": [1] * 2000}},
            "one number",
        ),
        ({**CONTENT, "version": 2}, "version 2"),
        ({"model": "ggx"}, "field 'parameters' is not an object"),
        ({**CONTENT, "parameters": {"name": 1, "metadata": 2}}, "parameters: "),
        ({**CONTENT, "parameters": CONTENT["parameters"] | {"roughness": 7}}, "roughness must"),
        ({**CONTENT, "parameters": CONTENT["parameters"] | {"roughness": "x"}}, "parameters: "),
        ({**CONTENT, "parameters": CONTENT["parameters"] | {"roughness": 10**400}}, "parameters: "),
        ({**CONTENT, "parameters": CONTENT["parameters"] | {"roughness": math.nan}}, "roughness"),
        ({**CONTENT, "parameters": CONTENT["parameters"] | {"diffuse": [[1], 2]}}, "parameters: "),
        ({**CONTENT, "name": []}, "field 'name'"),
        ({**CONTENT, "name": "\ud800"}, "surrogates"),
        ({**CONTENT, "metadata": {"fit": {"epochs": math.nan}}}, "not JSON compliant"),
        ({**CONTENT, "metadata": {"fit": 3}}, "metadata field 'fit'"),
    ],
)
def test_bad_content_is_one_line(content, message, tmp_path):
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(content))
    with pytest.raises(FormatError, match=message) as error:
        nacre.load(path)
    assert "\n" not in str(error.value)
    assert "bad.json" in str(error.value)
    assert len(str(error.value)) - len(str(path)) < 600


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (3.0, "3 rows of 90 numbers"),
        ([[1.0] * 89] * 3, "3 rows of 90 numbers"),
        ([[1.0] * 90, [1.0] * 90, [1.0] * 89], "parameters: "),
        ([[math.nan] * 90] * 3, "must lie in"),
        ([[-1e-3] * 90] * 3, "must lie in"),
        ([[1.1] * 90] * 3, "must lie in"),
        ([["x"] * 90] * 3, "parameters: "),
    ],
)
def test_bad_tables_of_a_model_are_one_line(table, message, tmp_path):
    path = tmp_path / "bad.json"
    values = EXAMPLES["npf"].values | {"fresnel": table}
    path.write_text(json.dumps({"model": "npf", "parameters": values}))
    with pytest.raises(FormatError, match=message) as error:
        nacre.load(path)
    assert len(str(error.value)) < 300


def test_truncated_files_are_refused(tmp_path):
    nacre.save(EXAMPLES["ggx"], tmp_path / "whole.json")
    data = (tmp_path / "whole.json").read_bytes().rstrip()
    for length in range(len(data)):
        path = tmp_path / "cut.json"
        path.write_bytes(data[:length])
        with pytest.raises(FormatError, match=r"cut\.json"):
            nacre.load(path)


def test_deep_nesting_is_refused(tmp_path):
    path = tmp_path / "deep.json"
    path.write_text('{"model": ' + "[" * 100_000)
    with pytest.raises(FormatError, match="deep"):
        nacre.load(path)


def test_a_table_of_one_needs_no_name(tmp_path):
    path = tmp_path / "ward.fit"
    path.write_text(f"# BSDF fits\n{LINE}\n")
    brdf = nacre.load(path)
    assert (brdf.name, brdf.values["roughness"]) == ("steel", 0.25)
    assert_allclose(brdf.values["specular"], (0.3, 0.2 * 1.15, 0.1 * 1.66))
    assert nacre.load(path, "steel").values == brdf.values


def test_a_table_of_several_lists_them(tmp_path):
    path = tmp_path / "ward.fit"
    path.write_text(f"{LINE}\n{LINE.replace('steel', 'brass')}\n")
    with pytest.raises(FormatError, match=r"2 materials; .* as --material: steel, brass"):
        nacre.load(path)
    with pytest.raises(FormatError, match="no material 'tin' among its 2; it has steel, brass"):
        nacre.load(path, "tin")
    path.write_text("".join(LINE.replace("steel", f"steel-{k}") + "\n" for k in range(900)))
    with pytest.raises(FormatError, match=r"steel-3, .* \.\.\.$") as error:
        nacre.load(path, "x" * 900)
    assert len(str(error.value)) - len(str(path)) < 600


def test_a_name_is_for_tables_only(tmp_path):
    nacre.save(EXAMPLES["ggx"], tmp_path / "x.json")
    with pytest.raises(FormatError, match="holds one material"):
        nacre.load(tmp_path / "x.json", "steel")


@pytest.mark.parametrize(
    "line",
    [
        LINE[:-1],
        LINE[:40],
        LINE.replace("0.25", "__import__('os').getpid()"),
        LINE.replace("0.25", "[0.25]"),
        LINE.replace("0.25", "1e999"),
        LINE.replace("NganWard", "NganHe"),
        LINE.replace("roughness = 0.25", "**{'roughness': 0.25}"),
        LINE.replace("roughness", "name"),
        LINE.replace("roughness", "diffuse"),
        LINE.replace("NganWard", "Bagher"),
        LINE.replace("0.25", "(" * 2000 + "1"),
        LINE.replace("0.25", "-" * 9000 + "1"),
        "steel = 3",
        "steel = " + "9" * 20_000,
        "Aggregate(",
    ],
)
def test_bad_tables_are_one_line(line, tmp_path):
    path = tmp_path / "bad.fit"
    path.write_text(f"# BSDF fits\n{line}\n")
    with pytest.raises(FormatError, match=r"bad\.fit") as error:
        nacre.load(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("table", "least"),
    [("bagher_sgd", 0.95), ("low_lowmicrofacet_E2", 0.97), ("low_lowsmooth_E2", 0.97)],
)
def test_published_parameters_look_like_published_networks(table, least):
    """What is left is the error of fits; a wrong formula or meaning shows at once."""
    path = require_data("merl-fits", f"{table}.fit")
    random = np.random.default_rng(0)
    wi, wo = (hemisphere(random, 4000).astype(np.float64) for _ in range(2))
    high = (wi[:, 2] > 0.3) & (wo[:, 2] > 0.3)
    logs = []
    for name in ("gold-metallic-paint", "blue-rubber", "pink-fabric", "pearl-paint"):
        network = nacre.load(require_data("pretrained", "merl", f"{name}.h5"))
        values = [
            np.log(b.eval(wi[high], wo[high]) + 1e-3) for b in (nacre.load(path, name), network)
        ]
        logs.append(np.corrcoef(*(v.ravel() for v in values))[0, 1])
    assert np.median(logs) > least


def test_colors_of_2005_are_stored_values_of_merl():
    """Fits of others to the same diffuse materials have the factors of MERL's reader already."""
    ngan, low = (require_data("merl-fits", f"{name}.fit") for name in NGAN_AND_LOW)
    ratios = [
        np.divide(nacre.load(ngan, name).values["diffuse"], nacre.load(low, name).values["diffuse"])
        for name in ("alumina-oxide", "nylon", "gray-plastic", "pink-felt", "violet-rubber")
    ]
    assert_allclose(np.median(ratios, axis=0), 1.0, atol=0.06)


def test_published_tables_load_whole():
    folder = require_data("merl-fits")
    for path in sorted(folder.glob("*.fit")):
        if path.stem != "ngan_he":
            for name in materials(path):
                assert nacre.load(path, name).name == name
