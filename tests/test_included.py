"""Materials that come with nacre: names, files, and whether these are what was published."""

from __future__ import annotations

import runpy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.included import families, names, resolve
from nacre.textures.latent_map import NeuralBtf
from tests.data import require_data
from tests.variants import require_mitsuba

ROOT = Path(__file__).parents[1]
PUBLISHED = {"merl": ("merl", ""), "nielsen": ("nielsen", ""), "nbrdf-rgl": ("rgl", "_rgb")}
"""Folder of the published files of a family, and what follows their names."""
WI, WO = [[0.0, 0.6, 0.8], [0.6, 0.0, 0.8]], [[0.0, -0.6, 0.8], [0.0, 0.0, 1.0]]


@cache
def script(name: str) -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "scripts" / name))


def published(name: str) -> Path:
    family, _, stem = name.partition(":")
    folder, ending = PUBLISHED[family]
    return require_data("pretrained", folder, f"{stem}{ending}.h5")


def test_families_have_a_source_and_terms() -> None:
    assert {f.name: f.terms.split()[0].rstrip(",") for f in families().values()} == {
        "captured": "MIT",
        "merl": "MIT",
        "nbrdf-rgl": "MIT",
        "nielsen": "MIT",
        "rgl": "CC0",
    }
    assert all(family.about and family.source for family in families().values())
    notice = (ROOT / "src/nacre/included/NOTICE.txt").read_text("utf-8")
    assert all(name in notice for name in families())
    assert "Permission is hereby granted" in notice


def test_all_of_them_are_small_and_can_be_evaluated() -> None:
    known = nacre.materials()
    assert [material.name for material in known] == list(names())
    assert sum(material.nbytes for material in known) < 1_500_000
    assert max(material.nbytes for material in known) < 1_000_000
    for material in known:
        loaded = nacre.load(material.name)
        assert loaded.name == material.title
        assert material.family.terms in (loaded.source or {})["terms"]
        if isinstance(loaded, nacre.Brdf):
            values = loaded.eval(WI, WO)
            assert np.isfinite(values).all()
            assert values.max() > 0.0
            assert material.kind == "brdf"


def test_words_choose_among_them() -> None:
    found = [material.name for material in nacre.materials("GOLD", "paint2")]
    assert found == ["merl:gold-metallic-paint2"]
    assert [m.name for m in nacre.materials("white a4 paper")] == ["rgl:paper_white"]


def test_a_file_of_the_name_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    inside = families()["rgl"].folder / "paper_white.safetensors"
    assert resolve("rgl:paper_white") == inside
    try:
        Path("rgl:paper_white").write_bytes(
            families()["merl"].folder.joinpath("chrome.safetensors").read_bytes()
        )
    except OSError:
        pytest.skip("files have no colons in their names here")
    assert resolve("rgl:paper_white") == Path("rgl:paper_white")
    assert nacre.load("rgl:paper_white").name == "chrome"


@pytest.mark.parametrize(
    "path", ["c:chrome", "c:\\rgl", "rgl/paper_white", "./merl:chrome", "a.b:c"]
)
def test_paths_are_no_names(path: str) -> None:
    assert resolve(path) == Path(path)


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("rgl:paper_wite", "rgl:paper_white"),
        ("rgl:satin_blue", "nbrdf-rgl:satin_blue"),
        ("mrl:chrome", "merl:chrome"),
        ("nothing:0123456789", "'nacre materials' lists"),
    ],
)
def test_an_unknown_name_is_told_with_those_like_it(name: str, near: str) -> None:
    with pytest.raises(nacre.FormatError, match="is neither a file nor a material") as caught:
        nacre.load(name)
    assert near in str(caught.value)


def test_a_mitsuba_plugin_takes_a_name() -> None:
    mi = require_mitsuba()
    nacre.mitsuba.register()
    bsdf = mi.load_dict({"type": "nbrdf", "filename": "merl:chrome"})
    assert "chrome" in str(bsdf)


def test_published_weights_are_the_nearest_halves() -> None:
    h5py = pytest.importorskip("h5py")
    folder = require_data("pretrained")
    found = 0
    for name in names():
        if name.partition(":")[0] not in PUBLISHED:
            continue
        layers = nacre.load(name).layers
        with h5py.File(published(name)) as file:
            stored = [file[f"{layer}/{layer}"] for layer in file if layer.startswith("dense")]
            parts = [np.asarray(group[part]) for group in stored for part in ("kernel:0", "bias:0")]
        ours = [array for layer in layers for array in layer]
        assert [a.shape for a in ours] == [p.shape for p in parts]
        for array, part in zip(ours, parts, strict=True):
            np.testing.assert_array_equal(array, part.astype(np.float16))
        found += 1
    assert found == len(list(folder.glob("*/*.h5")))


def test_a_published_network_is_made_again() -> None:
    made = script("included.py")
    original, here = nacre.load(published("merl:chrome")), nacre.load("merl:chrome")
    network = made["judged"](made["rounded"](original), Path("none"), original)
    np.testing.assert_allclose(network.eval(WI, WO), here.eval(WI, WO), rtol=1e-4)
    np.testing.assert_allclose(network.pdf(WI, WO), here.pdf(WI, WO), rtol=1e-3)
    told = here.metadata["quality"]["rounding_psnr"]
    assert network.metadata["quality"]["rounding_psnr"] == pytest.approx(told, abs=0.2)


def test_a_fit_is_as_close_as_told() -> None:
    table = nacre.load(require_data("rgl", "paper_white_rgb.bsdf"))
    here = nacre.load("rgl:paper_white")
    found = script("included.py")["psnr"](table, here, count=8)
    told = here.metadata["quality"]
    assert found["directional"] == pytest.approx(told["directional_psnr"], abs=0.2)


@pytest.mark.parametrize("name", [name for name in names() if name.startswith("captured:")])
def test_a_texture_is_that_of_the_gallery_seen_coarser(name: str) -> None:
    """Which was captured and encoded apart, at twice the resolution."""
    small = nacre.load(name)
    large = nacre.load(ROOT / "gallery/textures" / f"{name.partition(':')[2]}.safetensors")
    directions = np.array([[0.5, 0.2, 0.84], [0.05, -0.2, 0.98]])
    wi, wo = (
        d[None].astype(np.float32)
        for d in directions / np.linalg.norm(directions, axis=1, keepdims=True)
    )
    shown = []
    for texture in (small, large):
        assert isinstance(texture, NeuralBtf)
        picture = texture.at_directions(wi, wo).images(slice(None))[0].astype(np.float64)
        size = texture.width // 32
        shown.append(picture.reshape(32, size, 32, size, 3).mean(axis=(1, 3)))
    assert shown[0].mean((0, 1)) == pytest.approx(shown[1].mean((0, 1)), rel=0.1)
    assert np.corrcoef(shown[0].ravel(), shown[1].ravel())[0, 1] > 0.95


def test_the_page_of_names_is_what_the_generator_prints() -> None:
    committed = (ROOT / "docs/reference/materials.md").read_text("utf-8")
    again = "python scripts/materials.py > docs/reference/materials.md"
    assert committed == script("materials.py")["page"](), f"out of date: {again}"
