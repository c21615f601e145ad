"""Pictures that converge: errors that fall, and what is kept of them."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba", reason="needs the extra 'render'")

from nacre.brdf import CosineSampler
from nacre.color import tone_map
from nacre.figures.page import display_bytes
from nacre.sampling import BlinnPhongMixture
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.kitchen import SLOTS, describe_kitchen
from nacre_lab.reproduce.kitchen_page import CROPS, color_key, colors, kitchen_page
from nacre_lab.reproduce.noise import NoiseSettings, errors, run_noise
from nacre_lab.reproduce.noise_figures import equal_time, noise_table
from nacre_lab.reproduce.plates import describe_plates
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


def test_the_key_has_the_color_of_each_material_where_it_is():
    pytest.importorskip("matplotlib.figure", reason="needs the extra 'plot'")
    key, flat = color_key(3, (180, 120)), colors(3)
    bottle = key[57, 29]  # the tenth place: the first of three materials again
    np.testing.assert_allclose(bottle, flat[0], atol=0.02)
    found = [np.abs(key - color).max(axis=-1) < 0.02 for color in flat]
    assert all(place.mean() > 0.02 for place in found)
    walls = ~np.any(found, axis=0)
    assert np.median(np.ptp(key[walls], axis=-1)) < 0.01  # gray


def test_the_kitchen_page_shows_crops_of_every_sampler(tmp_path):
    figures = pytest.importorskip("matplotlib.figure", reason="needs the extra 'plot'")
    gloss = {"plastic": Glossy(0.1, 0.5, 0.08), "paint": Glossy(0.3, 0.05, 0.3)}
    brdfs = [brdf.replaced(name=name) for name, brdf in gloss.items()]
    settings = NoiseSettings(size=(60, 40), counts=(1, 4), shown=4, reference=16)
    study = run_noise(
        describe_kitchen, {"all": brdfs}, SAMPLERS, settings, Cache(tmp_path), lambda *_: None
    )
    page = kitchen_page(study, list(SAMPLERS))
    assert isinstance(page, figures.Figure)
    shown = [axes.images[0].get_array() for axes in page.axes]
    crop = CROPS[0].of(study.found["all", "lobes"].picture)
    assert crop.shape == (10, 14, 3)
    wanted = display_bytes(tone_map(crop))
    assert any(np.array_equal(pixels, wanted) for pixels in shown)
    assert len(shown) == 2 + len(brdfs) + len(CROPS) * (1 + len(SAMPLERS))
    written = {text.get_text() for text in page.texts}
    assert {"plastic", "paint", "cosine", "lobes"} <= written


def test_every_place_in_the_kitchen_has_its_material():
    shown = describe_kitchen([{"type": "diffuse", "id": slot} for slot in SLOTS])
    for slot in SLOTS:
        parts = [part for name, part in shown.items() if name.split("_")[0] == slot]
        assert parts
        for part in parts:
            if isinstance(part, dict):
                assert part["bsdf"]["id"] == slot
