"""Pictures that converge: errors that fall, and what is kept of them."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba", reason="needs the extra 'render'")

from nacre.brdf import CosineSampler
from nacre.render.kitchen import SLOTS, describe_kitchen
from nacre.render.plates import describe_plates
from nacre.reproduce.cache import Cache
from nacre.reproduce.noise import NoiseSettings, errors, run_noise
from nacre.reproduce.noise_figures import equal_time, noise_table
from nacre.sampling import BlinnPhongMixture
from tests.reflectances import Glossy

SMALL = NoiseSettings(size=(48, 32), counts=(1, 4, 32), shown=4, reference=512)
SAMPLERS = {
    "cosine": lambda brdf: CosineSampler(),
    "lobes": lambda brdf: BlinnPhongMixture(0.5, 300.0),
}


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("noise")
    groups = {"glossy": [Glossy(0.1, 0.5, 0.08)]}

    def run(fresh=False):
        calls = []
        found = run_noise(
            describe_plates,
            groups,
            SAMPLERS,
            SMALL,
            Cache(folder, fresh=fresh),
            lambda *c: calls.append(c),
        )
        return found, calls

    return run


def test_errors_fall_with_samples_and_faster_where_the_highlight_is_sampled(study):
    found, calls = study()
    for sampler in SAMPLERS:
        rmse = found.mean(sampler, "RMSE")
        assert rmse[0] > rmse[1] > rmse[2] > 0
        assert (np.diff(found.seconds(sampler)) > 0).all()
        assert (np.diff(found.mean(sampler, "PSNR")) > 0).all()
    assert found.mean("lobes", "RMSE")[-1] < found.mean("cosine", "RMSE")[-1]
    assert calls[-1][1:3] == (300, 300)


def test_finished_pictures_are_kept(study):
    first, _ = study()
    again, calls = study()
    assert calls == []
    for key, found in first.found.items():
        assert again.found[key].seconds == found.seconds
        np.testing.assert_array_equal(again.found[key].picture, found.picture)
    _, calls = study(fresh=True)
    assert calls


def test_the_table_compares_at_equal_time(study):
    found, _ = study()
    head, rows = noise_table(found, list(SAMPLERS))
    assert len(head) == len(rows[0]) == 7
    seconds = found.seconds("lobes")
    assert equal_time(found, "lobes", seconds[1]) == pytest.approx(found.mean("lobes", "RMSE")[1])
    between = equal_time(found, "lobes", 0.5 * (seconds[1] + seconds[2]))
    assert found.mean("lobes", "RMSE")[2] < between < found.mean("lobes", "RMSE")[1]


def test_errors_are_those_of_pictures_as_shown():
    truth = np.full((8, 8, 3), 0.25)
    other = np.full((8, 8, 3), 4.0)  # clipped to white
    found = errors(truth, other)
    dark = 0.25 ** (1 / 2.2)
    assert found["MAE"] == pytest.approx(1.0 - dark)
    assert found["RMSE"] == pytest.approx(1.0 - dark)
    assert found["MAPE"] == pytest.approx((1.0 - dark) / (dark + 0.01))
    assert errors(truth, truth)["PSNR"] > 100


def test_another_sampler_leaves_the_material_as_it_is():
    brdf = Glossy(0.1, 0.5, 0.08)
    other = brdf.replaced(sampler=BlinnPhongMixture(0.5, 300.0))
    assert type(other) is Glossy
    assert isinstance(other.sampler, BlinnPhongMixture)
    assert not isinstance(brdf.sampler, BlinnPhongMixture)


def test_every_place_in_the_kitchen_has_its_material():
    shown = describe_kitchen([{"type": "diffuse", "id": slot} for slot in SLOTS])
    for slot in SLOTS:
        parts = [part for name, part in shown.items() if name.split("_")[0] == slot]
        assert parts
        for part in parts:
            if isinstance(part, dict):
                assert part["bsdf"]["id"] == slot
