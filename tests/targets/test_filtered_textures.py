"""Encoded textures in few bytes per texel, filtered by samplers, against NumPy."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.array import Floats
from nacre.errors import NacreError
from nacre.geometry import cosine_hemisphere, join
from nacre.targets import TARGETS
from nacre.targets.textures import FilteredTexture
from nacre.targets.textures.accuracy import mean_squared_error
from nacre.textures.latent_file import save_latent_map
from nacre.textures.latent_map import LatentMap
from tests.cli.support import run
from tests.oracles.runners import browser, slang
from tests.oracles.runners import three as pages
from tests.oracles.texture_runner import exported
from tests.oracles.texture_runners.three import ThreeWebGl, plane
from tests.oracles.textures import FilteredTruth, Points, read_ktx2, read_levels
from tests.targets.made_texture import HEIGHT, NAME, RESOLUTION, WIDTH, texture
from tests.targets.support import needs
from tests.targets.test_three_textures import LIGHT, RENDERERS, seen
from tests.tiers import tiered

COUNT = 3000
STEP = 1.0 / 255.0
SIZES = 4, 8


@cache
def filtered(size: int = 8) -> FilteredTexture:
    return FilteredTexture.of(texture(), size, RESOLUTION)


@cache
def module(size: int = 8) -> Mapping[str, bytes]:
    return TARGETS["three"]().texture_files(texture(), filtered(size), NAME)


@cache
def truth(size: int = 8) -> FilteredTruth:
    return FilteredTruth(module(size), NAME, filtered(size).low, filtered(size).span)


def shown(radiance: Floats) -> Floats:
    """As an 8-bit display has it, without rounding: sRGB."""
    clipped = np.clip(radiance, 0.0, 1.0)
    return np.where(
        clipped < 0.0031308, 12.92 * clipped, 1.055 * np.maximum(clipped, 1e-9) ** (1 / 2.4) - 0.055
    )


@pytest.mark.parametrize("size", SIZES)
def test_shaders_say_what_numpy_says_of_the_same_bytes(size: int) -> None:
    """Between texels and levels, to the 8 bits of fractions that samplers have."""
    needs(pages.missing())
    at = Points.random(COUNT, 3, 0)
    found = ThreeWebGl().run(module(size), NAME, "eval", at)
    expected = truth(size).evaluate(at)
    cosine = np.maximum(at.wi[:, 2:], 0.0)
    away = np.abs(shown(found * cosine) - shown(expected * cosine))
    assert away.max() < STEP
    assert away.mean() < 0.05 * STEP
    assert shown(found * cosine).std() > 10.0 * STEP


@pytest.mark.parametrize(("size", "repeat"), [((21, 15), 1.0), ((10, 12), 4.0)])
@pytest.mark.parametrize("renderer", tiered(RENDERERS, RENDERERS[:2]))
def test_planes_wear_the_texture_with_its_mipmaps(
    renderer: str, size: tuple[int, int], repeat: float
) -> None:
    needs(pages.missing())
    options = {"repeat": repeat, "light": LIGHT.tolist(), "samples": 0}
    found = plane(module(), NAME, renderer, size, **options)[..., :3].reshape(-1, 3)
    expected = LIGHT[2] * truth().evaluate(seen(size, repeat, LIGHT))
    assert np.abs(shown(found) - shown(expected)).max() < STEP
    assert shown(found).std() > STEP


def test_more_bytes_err_less_down_to_the_error_of_the_grid() -> None:
    errors = [mean_squared_error(filtered(size), texture().latent) for size in (4, 8, 16, 32)]
    assert errors[0] > 1.3 * errors[1] > 1.3 * errors[2] > 1.05 * errors[3]


def test_texels_are_what_the_codec_decodes() -> None:
    """At the texture's own directions, as far as its stated error."""
    wi, wo = (join(cosine_hemisphere(*np.random.default_rng(k).random((2, 512)))) for k in (0, 1))
    latent = texture().latent
    decoder = latent.codec.decoder(wi.astype(np.float32), wo.astype(np.float32))
    expected = decoder(latent.codes.reshape(-1, latent.codes.shape[2])).reshape(-1, 3)
    y, x, pair = (part.ravel() for part in np.indices((HEIGHT, WIDTH, 512)))
    uv = np.stack([(x + 0.5) / WIDTH, (y + 0.5) / HEIGHT], axis=1).astype(np.float32)
    at = Points(uv, np.zeros(len(uv), np.float32), wi[pair], wo[pair])
    found = np.pi * truth().evaluate(at)
    stated = mean_squared_error(filtered(), latent)
    assert 0.5 * stated < np.mean(np.square(found - expected)) < 2.0 * stated


def test_coarser_levels_stand_for_mean_reflectance() -> None:
    up = np.tile(np.float32([[0.0, 0.0, 1.0]]), (HEIGHT * WIDTH, 1))
    y, x = np.indices((HEIGHT, WIDTH)).reshape(2, -1)
    uv = np.stack([(x + 0.5) / WIDTH, (y + 0.5) / HEIGHT], axis=1).astype(np.float32)
    texels, means = (
        truth().evaluate(Points(uv, np.full(len(uv), level, np.float32), up, up))
        for level in (0, len(filtered().weights[0]) - 1)
    )
    np.testing.assert_allclose(means[0], texels.mean(axis=0), rtol=0.03)
    roots = np.square(np.sqrt(texels).mean(axis=0))
    assert (np.abs(roots / texels.mean(axis=0) - 1.0) > 0.06).any()  # what means of bytes would be


def test_textures_are_files_that_another_reader_knows() -> None:
    needs(pages.missing())
    content = filtered().files(NAME)[f"{NAME}_weights1.ktx2"]
    script = b"""
        import { read } from "/three/examples/jsm/libs/ktx-parse.module.js";
        export async function parse() {
          const file = read(new Uint8Array(await (await fetch("/array.ktx2")).arrayBuffer()));
          const [block] = file.dataFormatDescriptor;
          return {
            format: file.vkFormat,
            size: [file.pixelWidth, file.pixelHeight, file.typeSize],
            transfer: block.transferFunction,
            samples: block.samples.map((of) => [of.bitOffset, of.bitLength, of.channelType]),
            plane: block.bytesPlane[0],
            levels: file.levels.map((level) => [...level.levelData]),
          };
        }"""
    files = {**pages.page(), "array.ktx2": content, "parse.js": script}
    found = browser.compute(files, "parse.js", "parse")
    assert found["format"] == 37  # VK_FORMAT_R8G8B8A8_UNORM
    assert found["size"] == [WIDTH, HEIGHT, 1]
    assert found["transfer"] == 1  # linear
    assert found["samples"] == [[8 * k, 7, channel] for k, channel in enumerate((0, 1, 2, 15))]
    assert found["plane"] == 4
    levels = [level.ravel().tolist() for level in read_levels(content)]
    assert found["levels"] == levels
    assert [len(level) for level in levels] == [4 * 35, 4 * 6, 4]


@pytest.mark.parametrize("language", ["wgsl", "glsl"])
def test_slang_modules_become_other_languages(language: str, tmp_path: Path) -> None:
    needs(slang.missing())
    files = exported("slang", texture(), filtered(), NAME)
    source = {path: body for path, body in files.items() if path.endswith(".slang")}
    text = slang.shader(
        NAME, {"all": f"float4({NAME}_eval(a[id.x].xy, 0.5, a[id.x].xyz, b[id.x].xyz), 0)"}
    )
    assert slang.compiled(tmp_path, source, text, language, "all").stat().st_size


def test_the_command_writes_and_states_what_was_asked_for(tmp_path: Path, capsys: Any) -> None:
    codes, folder = tmp_path / "cloth.safetensors", tmp_path / "out"
    save_latent_map(texture().latent, codes)
    size = "--bytes-per-texel", 8
    given = "export", codes, "-o", f"{folder}/", "--json", "-q"
    assert run(*given, "--to", "three", *size) == 0
    names = {f"{NAME}_{each}.ktx2" for each in ("weights0", "weights1", "functions", "lobes")}
    assert {path.name for path in folder.iterdir()} == {f"{NAME}.js", *names}
    listed = json.loads(capsys.readouterr().out)
    assert {Path(each["output"]).name for each in listed["files"]} == {f"{NAME}.js", *names}
    text = (folder / f"{NAME}.js").read_text()
    assert "RGBA8, 7 x 5, 3 levels, 168 bytes" in text
    assert "Error of the arrays against the codes: MSE x 1e4" in text
    assert read_ktx2((folder / f"{NAME}_weights1.ktx2").read_bytes()).dtype == np.uint8
    same = nacre.export(codes, "three", bytes_per_texel=8)
    assert text.encode().startswith(same.files[f"{NAME}.js"])  # a mark follows
    for target, asked, what in (
        ("onnx", 8, "takes no bytes per texel"),
        ("c", 8, "takes no bytes per texel"),
        ("blender", 8, "takes no textures"),
        ("three", 6, "multiple of 4"),
        ("three", 64, "32"),
    ):
        assert run(*given, "--to", target, "--bytes-per-texel", asked) == 2
        assert what in capsys.readouterr().err


def test_a_single_black_texel_stays_black() -> None:
    latent = texture().latent
    wi, wo = latent.wi[:50], latent.wo[:50]
    codes = latent.codec.encoder(wi, wo)(np.zeros((1, 50, 3), np.float32)).reshape(1, 1, -1)
    black = LatentMap(codes, latent.codec, wi, wo, NAME)
    made = FilteredTexture.of(black, 4, RESOLUTION)
    assert [level.shape for level in made.weights[0]] == [(1, 1, 4)]
    assert np.abs(made.span).max() < 1e-5
    assert mean_squared_error(made, black) < 2e-5


def test_a_reflectance_has_no_texels() -> None:
    with pytest.raises(NacreError, match="is no texture"):
        nacre.export("rgl:paper_white", "glsl", bytes_per_texel=8)
