"""Readings: what is read as instruments read it, and files of readings as people write them."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.errors import FormatError
from nacre.instruments import bidirectional, directional_hemispherical, gloss, haze, sphere
from nacre.instruments.goniocolorimeter import E2194, E2539, multiangle
from nacre.instruments.names import find_quantity
from nacre.instruments.quadrature import EXACT, SMOOTH
from nacre.instruments.quantities import (
    ColorQuantity,
    GlossQuantity,
    HazeQuantity,
    MultiangleQuantity,
    Quantity,
    SphereQuantity,
)
from nacre.instruments.readings import INSTRUMENTS, Reading, combined, known_quantities
from nacre.instruments.readings_file import is_readings, load_readings, save_readings
from nacre.latent import pretrained_basis

RED = Ggx(name="red", diffuse=(0.5, 0.05, 0.05), specular=(0.04, 0.04, 0.04), roughness=0.15)


def test_quantities_read_what_the_functions_of_instruments_do():
    def value(*words: str) -> float:
        return find_quantity(*words).read(RED)[0]

    assert value("gloss", "60") == pytest.approx(gloss(RED, 60).value)
    assert value("haze") == pytest.approx(haze(RED).value)
    assert value("log haze") == pytest.approx(haze(RED).log)
    assert value("compensated haze") == pytest.approx(haze(RED).compensated, rel=1e-9)
    both, sides = sphere(RED), bidirectional(RED)
    assert find_quantity("sphere", "SCI").read(RED) == pytest.approx(both.included.lab)
    assert find_quantity("sphere", "SCE").read(RED) == pytest.approx(both.excluded.lab)
    assert find_quantity("45-0", "45a:0").read(RED) == pytest.approx(sides.annular.lab)
    assert find_quantity("45-0", "45x:0").read(RED) == pytest.approx(sides.directional.lab)
    beam = directional_hemispherical(RED, 60.0)
    assert find_quantity("sphere", "60:di").read(RED) == pytest.approx(beam.lab)
    colors = multiangle(RED, E2539, illuminant="A", observer=10).colors
    for at, color in zip(E2539, colors, strict=True):
        assert find_quantity("MA-T12", at.name, "A", "10").read(RED) == pytest.approx(color.lab)
    f_r = find_quantity("f_r", "45 0 30 180")
    wi, wo = np.sqrt(0.5) * np.array([1.0, 0.0, 1.0]), np.array([-0.5, 0.0, np.sqrt(0.75)])
    assert f_r.read(RED) == pytest.approx(RED.eval(wi, wo).tolist())


@pytest.mark.parametrize(
    "quantity", [*known_quantities(), HazeQuantity("log"), HazeQuantity("compensated")]
)
def test_a_scale_is_turned_back(quantity: Quantity):
    seen = np.array([0.3, 0.2, 0.1]) if isinstance(quantity, ColorQuantity) else np.array([12.0])
    np.testing.assert_allclose(quantity.turned_back(quantity.shown(seen)), seen, rtol=1e-9)


@pytest.mark.parametrize("quantity", known_quantities(("gloss", "haze", "sphere")))
def test_few_nodes_do_for_what_codes_stand_for(quantity: Quantity):
    basis = pretrained_basis()
    shiny = basis.metadata["materials"].index("chrome")
    material = basis.decode(basis.examples[shiny])
    exact, few = (
        pairs.weights @ material.eval(pairs.wi, pairs.wo)
        for pairs in (quantity.pairs(EXACT), quantity.pairs(SMOOTH))
    )
    np.testing.assert_allclose(few, exact, rtol=0.01)


@pytest.mark.parametrize(
    ("instrument", "geometry", "name"),
    [
        ("gloss", "60", "gloss 60"),
        ("BYK micro-TRI-gloss", "20°", "gloss 20"),
        ("Gloss 85°", "", "gloss 85"),
        ("gloss_60", "", "gloss 60"),
        ("haze-gloss", "60", "gloss 60"),
        ("haze-gloss", "log haze", "haze log"),
        ("BYK-mac i", "-15", "multiangle 45as-15"),
        ("BYK-mac i", "110°", "multiangle 45as110"),
        ("MA-T12", "r45as-15", "multiangle 45as-15"),
        ("MA-T12", "45as_15", "multiangle 45as-15"),
        ("MA-T12", "r15asMinus45", "multiangle 15as-45"),
        ("X-Rite", "45as25az90", "multiangle 45as25az90"),
        ("CM-700d", "SCI", "sphere di:8"),
        ("sphere", "d/8 SCE", "sphere de:8"),
        ("sphere", "de:8", "sphere de:8"),
        ("reflectance", "60:di", "sphere 60:di"),
        ("reflectance", "8:di", "sphere di:8"),
        ("45/0", "", "45-0 45a:0"),
        ("45-0", "45x:0", "45-0 45x:0"),
        ("goniometer", "45, 0, 30, 180", "f_r 45 0 30 180"),
    ],
)
def test_spellings_of_the_field_are_understood(instrument: str, geometry: str, name: str):
    assert find_quantity(instrument, geometry).name == name


@pytest.mark.parametrize(
    ("illuminant", "observer", "expected"),
    [
        ("", "", ("D65", 2)),
        ("D65/10°", "", ("D65", 10)),
        ("a", "2 deg", ("A", 2)),
        ("F11", "10", ("F11", 10)),
        ("FL11", "2°", ("F11", 2)),
    ],
)
def test_illuminants_and_observers(illuminant: str, observer: str, expected: tuple[str, int]):
    found = find_quantity("sphere", "SCI", illuminant, observer)
    assert isinstance(found, ColorQuantity)
    assert (found.illuminant, found.observer) == expected


def write(folder: Path, text: str) -> Path:
    path = folder / "readings.csv"
    path.write_text(text, "utf-8")
    return path


def test_a_file_has_a_reading_a_row(tmp_path: Path):
    path = write(
        tmp_path,
        "# measured on Monday\n# illuminant: D65\n# observer: 10\n"
        "sample,Instrument,angle,value,L*,a*,b*,X,Y,Z,uncertainty,illuminant\n"
        "door,gloss,60,52.5,,,,,,,1,\n"
        "door,multiangle,45as15,,80,5,-3,,,,,A\n"
        "door,sphere,SCI,,,,,20,21,22,,\n"
        "door,sphere,SCE,,,,,,19.5,,2 %,\n"
        "door,haze,,,,,,,,,,\n"
        ",,,,,,,,,,,\n",
    )
    assert is_readings(path) is False  # the first column is another one
    first, color, included, excluded = load_readings(path)
    assert first == Reading(GlossQuantity(60.0), (52.5,), 1.0)
    assert color.quantity == MultiangleQuantity(E2194[1], illuminant="A", observer=10)
    assert (color.values, color.uncertainty) == ((80.0, 5.0, -3.0), 0.3)
    assert included.quantity == SphereQuantity("di:8", observer=10)
    assert included.values[0] == pytest.approx(116.0 * 0.21 ** (1 / 3) - 16.0)
    assert included.quantity.shown(included.seen).tolist() == pytest.approx(included.values)
    assert excluded.values == (19.5,)
    assert excluded.uncertainty == pytest.approx(0.39)
    assert excluded.quantity.unit == "Y"


def test_semicolons_and_decimal_commas_are_those_of_spreadsheets(tmp_path: Path):
    path = write(
        tmp_path, "\ufeffinstrument;geometry;value;L;a;b\ngloss;60;52,5;;;\n45/0;;;50;1,5;-2"
    )
    one, two = load_readings(path)
    assert one.values == (52.5,)
    assert two.values == (50.0, 1.5, -2.0)


def test_what_is_saved_reads_back_and_rows_to_fill_in_are_left_out(tmp_path: Path):
    words = ("gloss", "60"), ("haze", "log"), ("MA-T6", "45as15"), ("f_r", "45 0 30 180")
    readings = [Reading.of(RED, find_quantity(*each)) for each in words]
    readings.append(Reading.of(RED, find_quantity("sphere", "SCI", "F11", "10"), 0.4))
    path = tmp_path / "out.csv"
    save_readings(readings, path, [GlossQuantity(20.0)])
    assert is_readings(path)
    assert path.read_text("utf-8").splitlines()[-1].startswith("gloss,20,")
    for found, given in zip(load_readings(path), readings, strict=True):
        assert found.quantity == given.quantity
        assert found.values == pytest.approx(given.values, rel=1e-6)
        assert found.uncertainty == pytest.approx(given.uncertainty, rel=1e-6)


HEADER = "instrument,geometry,value,L*,a*,b*,uncertainty,illuminant\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("# only a remark\n", "has no columns"),
        ("geometry,value\n60,5\n", "instrument missing"),
        ("instrument,value,value\n", "value appears twice"),
        ("instrument,geometry,value,uncertanty\n", "did you mean uncertainty"),
        (HEADER, "has no reading"),
        (HEADER + "gloss,45,5,,,,,\n", "line 2: '45' is no angle of gloss"),
        (HEADER + "gloss,60,five,,,,,\n", "line 2: column value: 'five' is no number"),
        (HEADER + "gloss,60,nan,,,,,\n", "'nan' is no number"),
        (HEADER + "gloss,60,-1,,,,,\n", "column value: is below 0"),
        (HEADER + "gloss,60,5,,,,0,\n", "column uncertainty: must be above 0"),
        (HEADER + "gloss,60,5,50,1,1,,\n", "has value and L*/a*/b*"),
        (HEADER + "gloss,60,,50,1,1,,\n", "gloss 60 is read as value"),
        (HEADER + "sphere,SCI,5,,,,,\n", "sphere di:8 is read as L*, a*, b*"),
        (HEADER + "sphere,SCI,,50,1,,,\n", "column b*: is empty"),
        (HEADER + "sphere,SCI,,50,1,1,,D50\n", "illuminants are D65, A, F11"),
        (HEADER + "sphere,top,,50,1,1,,\n", "is not di:8 (SCI)"),
        (HEADER + "multiangle,45as-80,,50,1,1,,\n", "is below the surface"),
        (HEADER + "glos,60,5,,,,,\n", "did you mean gloss"),
        (HEADER + ",60,5,,,,,\n", "is empty; write one of gloss"),
        (HEADER + "gloss,60,5,,,,,,,,\n", "has 11 cells for 8 columns"),
        (HEADER + "f_r,45 0,,0,0,0,,\n", "write theta_i phi_i theta_o phi_o"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path: Path, text: str, words: str):
    path = write(tmp_path, text)
    with pytest.raises(FormatError) as error:
        load_readings(path)
    assert str(error.value).startswith(str(path))
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_that_was_cut_short_is_refused_or_shorter(tmp_path: Path):
    path = tmp_path / "whole.csv"
    save_readings([Reading.of(RED, quantity) for quantity in known_quantities(["E2194"])], path)
    whole = path.read_bytes()
    for end in range(0, len(whole), 7):
        path.write_bytes(whole[:end])
        with suppress(FormatError):
            assert len(load_readings(path)) <= 6


def test_repeated_readings_count_once():
    gloss_of = [Reading(GlossQuantity(60.0), (value,), 0.5) for value in (50.0, 52.0)]
    assert combined(gloss_of) == [Reading(GlossQuantity(60.0), (51.0,), 0.5)]


def test_readings_are_checked():
    for values, uncertainty in (((1.0, 2.0), 1.0), ((float("nan"),), 1.0), ((1.0,), 0.0)):
        with pytest.raises(ValueError, match="gloss 60"):
            Reading(GlossQuantity(60.0), values, uncertainty)
    with pytest.raises(ValueError, match="not 45"):
        GlossQuantity(45.0)


def test_known_quantities_are_different_ones():
    found = known_quantities(INSTRUMENTS)
    assert len(found) == len({quantity.name for quantity in found})
    assert {quantity.instrument for quantity in found} == {
        *("gloss", "haze", "multiangle", "sphere", "45-0")
    }
