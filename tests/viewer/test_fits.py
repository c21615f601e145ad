"""Networks that the page fits: of what it shows, of what is dropped on it, and what is saved."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic import AnisotropicGgx, Ggx
from nacre.brdf import Brdf
from nacre.measured import rgl, rgl_writer
from nacre.measured.merl import Resolution, tabulate
from nacre.mitsuba.studio import studio
from nacre.neural.recipe import Recipe
from nacre.sampling.mixture import GgxMixture
from nacre.viewer.content import Entry
from tests.measured.support import hemisphere
from tests.targets.support import needs
from tests.tiers import tiered
from tests.viewer.fitting import BUTTON, drop, fit, saved, start
from tests.viewer.tab import Tab, page, wait_for

AXE = Path(sys.prefix) / "three/node_modules/axe-core/axe.min.js"  # by scripts/setup.py
GRAY = {"diffuse": (0.2, 0.1, 0.05), "specular": (0.3, 0.3, 0.3)}
SHINY = Ggx(**GRAY, roughness=0.3)
BRUSHED = AnisotropicGgx(**GRAY, roughness_x=0.2, roughness_y=0.5, angle=0.5)
FEW = """Object.assign(window.page.facts.fit, { samples: 80000, scattered: 32000 });
window.page.facts.fit.presets.standard.epochs = 4000"""  # drafts are short, the others endless
NOWHERE = "() => void (window.page.materials.shown(window.page.form).known = '0.0')"


def content(entries: dict[str, Brdf]) -> bytes:
    return page("Fits", [Entry(name, {"Formula": x}) for name, x in entries.items()], [studio()])


@pytest.fixture(scope="module")
def tab(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with Tab(chromium, tmp_path_factory.mktemp("fits")) as opened:
        opened.open(content({"Shiny": SHINY, "Brushed": BRUSHED}))
        opened.page.evaluate(f"{FEW}; window.page.renderer.resize(32, 32)")
        yield opened


def shown(tab: Tab, count: int = 300) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions, and f_r there as the page draws it."""
    wi, wo = (hemisphere(np.random.default_rng(seed), count) for seed in (0, 1))
    found = tab.page.evaluate(
        """([wi, wo]) => {
            const { materials, form } = window.page, material = materials.shown(form);
            const pair = [wi, wo].map((w) => Float32Array.from(w));
            return [...window.page.renderer.values(material, ...pair)];
        }""",
        [wi.ravel().tolist(), wo.ravel().tolist()],
    )
    return wi, wo, np.reshape(found, (-1, 4))[:, :3]


def check(tab: Tab, truth: Brdf, path: Path, median: float) -> Brdf:
    """The saved network, which is what the page shows, and close to the truth."""
    network = nacre.load(saved(tab, path))
    assert isinstance(network, Brdf)
    wi, wo, found = shown(tab)
    np.testing.assert_allclose(found, network.eval(wi, wo), 5e-4, 5e-4)
    values = truth.eval(wi, wo)
    assert np.median(np.abs(network.eval(wi, wo) - values) / values) < median
    return network


def ended(tab: Tab) -> None:
    """Wait until the page has no workers."""
    wait_for(tab.page, lambda: not tab.page.workers, "workers go on")


@pytest.mark.slow
@pytest.mark.parametrize(("k", "truth"), tiered([(0, SHINY), (1, BRUSHED)], lambda c: not c[0]))
def test_a_formula_is_fitted_and_saved(tab: Tab, tmp_path: Path, k: int, truth: Brdf) -> None:
    tab.page.evaluate(f"window.page.choose({k})")
    fit(tab, "draft")
    assert tab.page.locator("#forms button[aria-pressed=true]").inner_text() == "Neural, draft"
    network = check(tab, truth, tmp_path / "network.safetensors", 0.1)
    assert network.isotropic == truth.isotropic
    settings = network.metadata["fit"]
    usual = Recipe.preset("draft")
    assert settings["learning_rate"] == usual.learning_rate
    assert settings["activation"] == usual.hidden_activation
    assert settings["samples"] == (10_000 if k == 0 else 50_000)
    assert 0.0 < network.metadata["quality"]["held_out_loss"] < 0.2
    assert isinstance(network.sampler, GgxMixture)
    if k:
        assert network.angle == pytest.approx(0.5, abs=0.03)


@pytest.mark.slow
def test_a_dropped_table_is_fitted(tab: Tab, tmp_path: Path) -> None:
    path = tmp_path / "shiny.bsdf"
    small = rgl_writer.Resolution(1, 8, 32, 32, 16)
    table = rgl.tabulate(SHINY, small)
    rgl.save(table, path)
    drop(tab, path, 32)
    fit(tab, "draft")
    network = check(tab, table, tmp_path / "network.safetensors", 0.1)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert network.metadata["source"] == {"file": "shiny.bsdf", "sha256": digest}


def test_a_dropped_scan_is_shown_and_fitted(tab: Tab, tmp_path: Path) -> None:
    path = tmp_path / "shiny.csv"
    nacre.save(SHINY, path)
    scan = nacre.load(path)
    assert isinstance(scan, Brdf)
    drop(tab, path, 32)
    # The page holds what nacre view would, a table of the interpolation.
    wi, wo, found = shown(tab)
    table = tabulate(scan, Resolution(60, 30, 45))
    known = table.valid(wi, wo)
    np.testing.assert_allclose(found[known], table.eval(wi, wo)[known], 5e-3, 1e-3)
    fit(tab, "draft")
    network = check(tab, scan, tmp_path / "network.safetensors", 0.15)
    quality, settings = network.metadata["quality"], network.metadata["fit"]
    assert (settings["gain"], settings["batch"], settings["precision"]) == (None, 256, "single")
    assert quality["held_out_samples"] == round(0.2 * len(scan.samples))
    ours = quality["nearest_sample_median_error"]
    theirs = nacre.fit(scan, Recipe(samples=2000, epochs=1)).metadata["quality"]
    assert ours == pytest.approx(theirs["nearest_sample_median_error"], rel=0.01)  # ties


def test_a_fit_is_cancelled(tab: Tab) -> None:
    tab.page.evaluate("window.page.choose(0)")
    before = tab.page.evaluate("(window.before = [...window.page.chosen.forms]).length")
    start(tab, "standard")
    tab.wait("window.page.fitting.bar.hasAttribute('value')")
    assert tab.page.locator(".fitting progress").get_attribute("aria-label")
    tab.page.click(BUTTON.format("Cancel"))
    tab.wait("!window.page.fitting.fit")
    same = "window.before.every((form, k) => window.page.chosen.forms[k] === form)"
    assert tab.page.evaluate(f"{same} && window.page.chosen.forms.length") == before
    assert tab.page.locator(".fitting [role=status]").inner_text() == "Cancelled."
    assert not tab.page.locator("#trouble").inner_text()
    ended(tab)


@pytest.mark.slow
def test_what_is_known_nowhere_is_refused_in_a_line(tab: Tab) -> None:
    tab.page.evaluate("window.page.choose(0)")
    tab.page.evaluate(NOWHERE)
    start(tab, "draft")
    tab.wait("!window.page.fitting.fit && document.getElementById('trouble').textContent")
    assert tab.page.locator("#trouble").inner_text() == "Shiny: hardly any sample is valid"
    tab.page.evaluate("window.page.materials.read.clear()")


@pytest.mark.slow
def test_axe_finds_nothing_during_a_fit(tab: Tab) -> None:
    needs(None if AXE.is_file() else "axe-core (make tools, with npm)")
    tab.page.evaluate(AXE.read_text())
    tab.page.evaluate("window.page.choose(0)")
    start(tab, "standard")
    found = tab.page.evaluate("() => axe.run()")
    assert not [(each["id"], each["help"]) for each in found["violations"]]
    tab.page.click(BUTTON.format("Cancel"))
    tab.wait("!window.page.fitting.fit")


@pytest.mark.slow
def test_without_webassembly_the_page_says_so(chromium: Any, tmp_path: Path) -> None:
    with Tab(chromium, tmp_path) as tab:
        tab.page.add_init_script("delete globalThis.WebAssembly;")
        tab.open(content({"Shiny": SHINY}))
        assert not tab.page.locator(BUTTON.format("Make it neural")).is_visible()
        assert "WebAssembly" in tab.page.locator(".fitting [role=status]").inner_text()


@pytest.mark.slow
def test_twenty_fits_leave_nothing_behind(tab: Tab) -> None:
    held = """() => {
        const { renderer, materials, chosen } = window.page;
        return [renderer.linkedPrograms.size, materials.read.size, chosen.forms.length];
    }"""
    tab.page.evaluate("window.page.choose(0)")
    session = tab.page.context.new_cdp_session(tab.page)

    def heap() -> float:
        session.send("HeapProfiler.collectGarbage")
        return float(session.send("Runtime.getHeapUsage")["usedSize"])

    def fits(*seeds: int) -> None:
        for seed in seeds:
            tab.page.evaluate(f"window.page.facts.fit.presets.draft.seed = {seed}")
            fit(tab, "draft")

    fits(1, 2, 3)
    before, bytes_ = tab.page.evaluate(held), heap()
    fits(*range(4, 24))
    assert tab.page.evaluate(held) == before
    ended(tab)
    assert heap() < bytes_ + 2e6
