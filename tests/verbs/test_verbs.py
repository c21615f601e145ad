"""The verbs: materials and paths in, things that show and save themselves out."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic.ggx import Ggx
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.neural import NeuralBrdf
from nacre.verbs import Picture
from tests.cli.support import run, run_json
from tests.specimens import SPECIMENS
from tests.spectra import spectral_network
from tests.variants import require_mitsuba

PAPER = "rgl:paper_white"
QUICK: dict[str, Any] = {"epochs": 2, "samples": 4000}
SMALL: dict[str, Any] = {"size": 16, "spp": 1, "denoise": False}


@pytest.fixture(scope="module")
def paper() -> Brdf:
    found = nacre.load(PAPER)
    assert isinstance(found, Brdf)
    return found


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with a measured reflectance, a measured and an encoded texture."""
    monkeypatch.chdir(tmp_path)
    for name, kind in (("paint.bsdf", "RGL"), ("weave.npz", "NumPy archive of a BTF")):
        Path(name).write_bytes(SPECIMENS[kind].files()[0])
    Path("weave.safetensors").write_bytes(SPECIMENS["nacre encoded texture"].files()[0])
    return tmp_path


def test_a_material_a_path_a_name_and_an_item_of_the_list_are_taken(folder: Path) -> None:
    (item,) = nacre.materials("nbrdf-rgl:paper_white")
    material = nacre.load(item.path)
    nacre.save(material, "here.safetensors")
    figures = {
        tuple(nacre.info(given, physics=False)["layers"])
        for given in (item, item.name, item.path, str(item.path), material, "here.safetensors")
    }
    assert len(figures) == 1
    for wrong in (3, None, [material]):
        with pytest.raises(TypeError, match="expected a material, or the path or name of one"):
            nacre.info(wrong)  # type: ignore[arg-type]


# info


def test_info_is_a_mapping_that_reads_as_a_table(paper: Brdf) -> None:
    facts = nacre.info(paper)
    assert facts["weights"] == 675
    assert set(facts.units) <= set(facts)
    text = repr(facts)
    assert text.splitlines()[0] == "White A4 paper (160 gsm)"
    assert "  weights " in text
    assert "<th>weights</th><td>675</td>" in facts._repr_html_()
    of_file = nacre.info(PAPER)
    assert {*of_file} - {*facts} == {"bytes", "sha256", "terms"}
    assert repr(of_file).startswith("rgl:paper_white\n")


def test_info_of_textures_and_other_files(folder: Path) -> None:
    texture = nacre.load("weave.npz")
    assert nacre.info(texture)["width"] == nacre.info("weave.npz")["width"] == 3
    assert nacre.info("weave.npz").kind == "btf"
    with pytest.raises(TypeError, match="quantity is for the path of a material"):
        nacre.info(texture, pixels="radiance")


# fit


def test_fit_takes_a_recipe_a_preset_and_settings_on_top(paper: Brdf) -> None:
    recipe = nacre.Recipe(**QUICK)
    network = nacre.fit(paper, recipe)
    assert network == nacre.fit(paper, recipe) == nacre.fit(PAPER, **QUICK)
    assert network == nacre.neural.fit(paper, recipe)
    seeded = nacre.fit(paper, recipe, seed=1)
    assert seeded != network
    assert seeded.metadata["fit"]["seed"] == 1
    draft = nacre.fit(paper, "draft", **QUICK)
    assert draft == nacre.fit(paper, preset="draft", **QUICK)
    assert draft.metadata["fit"]["learning_rate"] == 2e-2
    assert nacre.fit(paper, max_bytes=400, **QUICK).nbytes <= 400


def unmarked(name: str) -> tuple[dict[str, Any], bytes]:
    """Header and tensors of a file, without the mark of who wrote it."""
    data = Path(name).read_bytes()
    end = 8 + int.from_bytes(data[:8], "little")
    header = json.loads(data[8:end])
    del header["__metadata__"]["written by"]
    return header, data[end:]


def test_fit_is_what_the_command_writes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ("--preset", "draft", "--epochs", 2, "--samples", 4000)
    assert run("fit", "paint.bsdf", "-o", "command.safetensors", *options) == 0
    written = nacre.load("command.safetensors")
    nacre.save(nacre.fit("paint.bsdf", "draft", **QUICK), "verb.safetensors")
    assert unmarked("verb.safetensors") == unmarked("command.safetensors")
    assert isinstance(written, NeuralBrdf)


def test_fit_of_a_model(paper: Brdf) -> None:
    assert isinstance(nacre.fit(paper, model="ggx", samples=2000), Ggx)


def test_fit_of_a_texture_is_what_the_command_writes(folder: Path) -> None:
    btf = nacre.load("weave.npz")
    texture = nacre.fit(btf)
    assert isinstance(texture, Btf)
    assert texture.latent is not None
    nacre.save(texture, "verb.safetensors")
    again = nacre.load("verb.safetensors")
    np.testing.assert_array_equal(again.texels(slice(None)), texture.texels(slice(None)))
    assert nacre.fit(btf, precision="half").latent.codes.dtype == np.float16
    with pytest.raises(nacre.FormatError, match="encode this one with nacre fit"):
        nacre.save(btf, "plain.safetensors")


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"recipe": "drft"}, ValueError, "no preset; did you mean 'draft'?"),
        ({"recipe": "ggx"}, ValueError, r"nacre.fit\(..., model='ggx'\)"),
        ({"recipe": "a.safetensors"}, ValueError, r"nacre.save\(nacre.fit\(...\), 'a.safeten"),
        ({"recipe": 5}, TypeError, "takes a nacre.Recipe or the name of a preset, got int"),
        ({"epoch": 5}, TypeError, "no keyword 'epoch'; did you mean 'epochs'?"),
        ({"size": 5}, TypeError, "no keyword 'size'"),
        ({"zzz": 5}, TypeError, r"no keyword 'zzz' \(known: activation, "),
        ({"epochs": 0}, ValueError, "epochs must be positive"),
        ({"recipe": nacre.Recipe(), "preset": "draft"}, TypeError, "a recipe or a preset"),
        ({"recipe": "draft", "preset": "best"}, TypeError, "takes one preset"),
        ({"model": "gxx"}, nacre.NacreError, "no model; did you mean 'ggx'?"),
        ({"model": "ggx", "epochs": 3}, TypeError, "fit.. of ggx has no keyword 'epochs'"),
        ({"model": "ggx", "device": "cpu"}, TypeError, "takes no device here: ggx is no network"),
        ({"codec": "basis"}, TypeError, "takes no codec here: White A4"),
    ],
)
def test_fit_says_what_to_write(
    paper: Brdf, given: dict[str, Any], error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        nacre.fit(paper, **given)


def test_fit_of_what_else_it_may_be_given(folder: Path) -> None:
    with pytest.raises(TypeError, match="takes no recipe here: "):
        nacre.fit("weave.npz", "draft")
    with pytest.raises(TypeError, match="of a texture has no keyword 'epochs'"):
        nacre.fit("weave.npz", epochs=3)
    with pytest.raises(ValueError, match="precision must be one of single, half"):
        nacre.fit("weave.npz", precision="double")
    with pytest.raises(nacre.NacreError, match=r"is a folder; .*fit_library"):
        nacre.fit(folder)


# render


def test_render_gives_a_picture(paper: Brdf, tmp_path: Path) -> None:
    require_mitsuba()
    picture = nacre.render(paper, **SMALL)
    assert isinstance(picture, Picture)
    assert (picture.shape, picture.dtype) == ((16, 16, 3), np.float32)
    assert repr(picture) == "<Picture, 16 x 16 pixels, linear RGB; .save(path) writes it>"
    np.testing.assert_allclose(picture, nacre.render(PAPER, "ball", **SMALL), rtol=1e-5)
    shown = picture._repr_png_()
    path = picture.save(tmp_path / "a.png")
    pillow = pytest.importorskip("PIL.Image")
    with pillow.open(path) as image:
        np.testing.assert_array_equal(np.asarray(image), picture.displayed())
    assert shown is not None
    assert shown.startswith(b"\x89PNG")
    wide = nacre.render(paper, "sphere", "directional", size=16, height=8, spp=1, denoise=False)
    assert wide.shape == (8, 16, 3)
    assert wide.save(tmp_path / "a.exr").stat().st_size > 0


def test_render_of_textures_and_animations(folder: Path) -> None:
    require_mitsuba()
    still = nacre.render("weave.safetensors", "plane", size=16, spp=1, repeat=1, decode="table")
    assert still.shape == (16, 16, 3)
    film = nacre.render("weave.safetensors", light="point", frames=2, size=16, spp=1)
    assert film.shape == (2, 16, 16, 3)
    assert "2 frames of 16 x 16 pixels" in repr(film)
    assert film.save("film.gif").read_bytes()[:3] == b"GIF"
    assert (film._repr_png_() or b"").startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("file", "given", "words"),
    [
        (PAPER, {"shape": "a.png"}, r"nacre.render\(...\).save\('a.png'\)"),
        (PAPER, {"shape": "sphre"}, "did you mean 'sphere'?"),
        (PAPER, {"light": "point"}, "'point' is no light here"),
        (PAPER, {"repeat": 2}, "repeat cannot be used here: White A4"),
        ("weave.npz", {"height": 2}, "height cannot be used here: .* shown in a square"),
        ("weave.npz", {"shape": "ball"}, "'ball' is no shape here"),
        ("weave.npz", {"frames": 2}, 'add light="directional"'),
        ("weave.npz", {"frames": 2, "light": "point", "denoise": True}, "not for animations"),
        ("scene.xml", {"shape": "ball"}, "shape cannot be used here: scene.xml is a scene"),
        ("a.png", {}, r"there is no such file; to write it, call .save\('a.png'\)"),
        ("rgl:paper_wite", {}, "did you mean rgl:paper_white"),
    ],
)
def test_render_says_what_to_write(
    folder: Path, file: str, given: dict[str, Any], words: str
) -> None:
    Path("scene.xml").write_text("<scene version='3.0.0'/>")
    with pytest.raises(nacre.NacreError, match=words):
        nacre.render(file, **given)


def test_a_picture_is_an_array() -> None:
    picture = Picture.of(np.full((4, 5, 3), 0.5, np.float32))
    assert type(picture.mean()) is np.float32
    assert type(picture.mean(axis=2)) is np.ndarray
    assert isinstance(picture * 2.0, Picture)
    assert isinstance(pickle.loads(pickle.dumps(picture)), Picture)
    assert picture[0, 0]._repr_png_() is None
    assert repr(picture[0, 0]).startswith("array(")
    assert int(picture.displayed()[0, 0, 0]) == 186
    with pytest.raises(nacre.NacreError, match=r"not \(5, 3\)"):
        picture[0].save("a.png")
    display = Picture.of(np.full((4, 5, 3), 7, np.uint8))
    assert "display values" in repr(display)
    np.testing.assert_array_equal(display.displayed(), display)


# compare


def test_compare_has_the_figures_of_the_command(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nacre.save(nacre.load(PAPER), "paper.safetensors")
    found = nacre.compare("paint.bsdf", "paper.safetensors", size=16)
    data = run_json(capsys, "compare", "paint.bsdf", "paper.safetensors", "--size", 16)
    told = data["figures"]["environment"]["flip"]
    assert found.figures["environment"]["FLIP"] == pytest.approx(told)
    assert repr(found).startswith("paper.safetensors against paint.bsdf\nenvironment  SSIM")
    assert found.picture.dtype == np.uint8
    assert found.save("sheet.png") == Path("sheet.png")
    assert "data:image/png" in found._repr_html_()
    assert nacre.compare(PAPER, PAPER, size=16).other == f"{PAPER} (NeuralBrdf)"


def test_compare_of_textures(folder: Path) -> None:
    found = nacre.compare("weave.npz", "weave.npz")
    assert found.figures["values"]["MSE x 1e4"] == 0.0
    assert found.picture.ndim == 3
    with pytest.raises(nacre.FormatError, match=r"weave.npz: is a texture, but paint.bsdf is a"):
        nacre.compare("paint.bsdf", "weave.npz")


# plot and view


def test_plot_shows_itself(paper: Brdf, folder: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    drawn = nacre.plot(paper, "paint.bsdf", paper, "weave.npz", incidence=45, azimuth=10.0)
    names = "White A4 paper (160 gsm)", "paint.bsdf", "White A4 paper (160 gsm) (NeuralBrdf)"
    assert drawn.materials == (*names, "weave.npz")
    assert "<svg" in drawn._repr_svg_()
    assert drawn.save("lobes.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(nacre.NacreError, match="incidence lies from 0 to below 90 degrees"):
        nacre.plot(paper, incidence=(90.0,))
    with pytest.raises(nacre.FormatError, match=r"call .save\('lobes.svg'\)"):
        nacre.plot(paper, "lobes.svg")
    with pytest.raises(TypeError, match=r"nacre.plot\(material\)"):
        nacre.plot()


def test_plot_over_wavelength(paper: Brdf, folder: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    drawn = nacre.plot(spectral_network(), spectrum=True, incidence=45)
    assert (drawn.materials, len(drawn.figure.axes)) == (("random",), 2)
    with pytest.raises(nacre.NacreError, match="known in RGB only"):
        nacre.plot(paper, spectrum=True)
    with pytest.raises(ValueError, match="are for lobes"):
        nacre.plot(spectral_network(), spectrum=True, cosine=True)


@pytest.mark.slow
def test_view_is_a_page(paper: Brdf, folder: Path) -> None:
    page = nacre.view(
        paper,
        Ggx(diffuse=(0.1, 0.1, 0.1), specular=(0.5, 0.5, 0.5), roughness=0.3).replaced(
            name=paper.name
        ),
    )
    assert (page.materials, page.title) == (1, paper.name)
    assert page.save("page.html").read_bytes().startswith(page.content)
    assert "<iframe srcdoc=" in page._repr_html_()
    assert repr(page).startswith("<Page 'White A4 paper (160 gsm)': 1 material, ")
    assert nacre.view(PAPER, "paint.bsdf", title="Two").materials == 2
    for wrong, words in (
        (("weave.npz",), "encoded"),
        (("page.png",), r"call .save\('page.png'\)"),
        (("nothing.bsdf",), "nothing.bsdf"),
    ):
        with pytest.raises(nacre.NacreError, match=words):
            nacre.view(*wrong)
    with pytest.raises(nacre.FormatError, match=r"ends in .html"):
        page.save("page.pdf")
    with pytest.raises(TypeError, match=r"nacre.view\(material\)"):
        nacre.view()


# export


def test_export_is_what_the_command_writes(folder: Path) -> None:
    files = nacre.export(PAPER, "glsl")
    assert list(files) == ["paper_white.glsl"]
    assert "vec3 paper_white_eval(" in files.text
    assert str(files) == files["paper_white.glsl"] == files.text
    assert run("export", PAPER, "--to", "glsl", "-o", "command.glsl") == 0
    assert Path("command.glsl").read_text().startswith(files.text)
    assert files.save("verb.glsl") == (Path("verb.glsl"),)
    written = nacre.export(PAPER, "glsl", "out/")
    assert written.paths == (Path("out/paper_white.glsl"),)
    assert repr(written).startswith("<glsl: out/paper_white.glsl (")


def test_export_of_several_files_and_of_bytes(folder: Path) -> None:
    files = nacre.export("paint.bsdf", "mdl")
    assert {Path(name).suffix for name in files} == {".mdl", ".mbsdf"}
    kinds = {Path(name).suffix: type(content) for name, content in files.items()}
    assert kinds == {".mdl": str, ".mbsdf": bytes}
    assert str(files) == repr(files)
    with pytest.raises(nacre.NacreError, match="is not one text but"):
        _ = files.text
    assert len(files.save("there")) == 2


@pytest.mark.slow
def test_export_to_a_place(folder: Path) -> None:
    made = nacre.export(PAPER, "usd", name="sheet")
    assert [each.representation.target for each in made.representations] == ["usda"]
    assert {*made} == {"sheet.usda", "sheet-readme.txt"}


def test_export_says_what_to_write(folder: Path) -> None:
    with pytest.raises(nacre.NacreError, match="no export target or place; did you mean 'glsl'"):
        nacre.export(PAPER, "glsll")
    with pytest.raises(nacre.NacreError, match="add height_field="):
        nacre.export(PAPER, "glsl", depth=0.1)
    with pytest.raises(nacre.NacreError, match="usd takes reflectances only"):
        nacre.export("weave.safetensors", "usd")


# convert and estimate


def test_convert_writes_and_says_what_is_lost(folder: Path) -> None:
    made = nacre.convert("paint.bsdf", "paint.binary", resolution=(9, 9, 18))
    assert made.path == Path("paint.binary")
    assert made.median is not None
    assert 0.0 < made.median < 1.0
    assert nacre.convert("weave.npz", "again.npz", precision="single").loss is None
    assert nacre.load("again.npz").pair_count == nacre.load("weave.npz").pair_count
    for given, error, words in (
        (("paint.bsdf", "paint.bsdf"), nacre.FormatError, "paint.bsdf"),
        (("weave.npz", "x.npz"), TypeError, "resolution is for reflectances; .* is a texture"),
        (("paint.bsdf", "x.safetensors"), nacre.FormatError, "x.safetensors"),
    ):
        with pytest.raises(error, match=words):
            nacre.convert(*given, resolution=(9, 9, 18) if error is TypeError else None)
    with pytest.raises(TypeError, match="precision is for textures"):
        nacre.convert("paint.bsdf", "x.binary", precision="half")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "say what was photographed"),
        ({"scene": "scene.xml"}, "needs the id of a BSDF: bsdf="),
        ({"geometry": "sphere"}, "needs its light: environment="),
        ({"geometry": "cube", "environment": "a.exr"}, 'write geometry="sphere"'),
    ],
)
def test_estimate_says_what_to_write(given: dict[str, Any], words: str) -> None:
    with pytest.raises(nacre.NacreError, match=words):
        nacre.estimate("photo.exr", **given)


def test_estimate_takes_pictures_in_memory(folder: Path) -> None:
    require_mitsuba()
    nacre.render(PAPER, **SMALL).save("photo.exr")
    light = Picture.of(np.ones((4, 8, 3), np.float32))
    light.save("light.exr")
    flat = np.zeros((16, 16), np.float32)
    with pytest.raises(nacre.NacreError, match=r"not \(16, 16\)"):
        nacre.estimate([flat], geometry="sphere", environment="light.exr")
