"""The memory that a material takes, by one definition for all kinds."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.analytic import MODELS
from nacre.measured import ScatteredBrdf, merl, rgl, utia
from nacre.measured.rgl_writer import Resolution
from tests.analytic.materials import EXAMPLES
from tests.mitsuba.reflectances import network
from tests.reflectances import Glossy


@pytest.mark.parametrize(
    ("name", "size"), [("ggx", 28), ("sgd", 132), ("npf", 3264), ("tabulated-microfacets", 1800)]
)
def test_analytic_models_take_four_bytes_a_number(name, size):
    assert EXAMPLES[name].nbytes == size == EXAMPLES[name].describe()["memory bytes"]
    count = sum(np.size(value) for value in EXAMPLES[name].values.values())
    assert size == 4 * count
    assert set(EXAMPLES) == set(MODELS)


def test_the_papers_network_takes_2700_bytes():
    assert network(0).nbytes == 2700


def test_tables_take_what_their_nodes_do():
    glossy = Glossy(0.2, 0.5, 0.3)
    assert merl.tabulate(glossy, merl.Resolution(10, 10, 20)).nbytes == 2000 * 3 * 4
    assert utia.tabulate(glossy).nbytes == 3 * 288 * 288 * 4
    tables = rgl.tabulate(glossy, Resolution(1, 12, 17, 4, 32)).tables
    assert 47_000 < tables.nbytes < 50_000
    arrays = (tables.phi_i, tables.theta_i, tables.ndf, tables.sigma, tables.vndf, tables.rgb)
    assert tables.nbytes == 4 * sum(array.size for array in arrays)


def test_scans_take_what_their_samples_do():
    up = np.tile([0.0, 0.6, 0.8], (5, 1))
    assert ScatteredBrdf(up, up, np.ones((5, 3))).nbytes == 5 * 9 * 8


def test_a_formula_without_numbers_takes_none():
    assert Glossy(0.2, 0.5, 0.3).nbytes is None
    assert "memory bytes" not in Glossy(0.2, 0.5, 0.3).describe()
