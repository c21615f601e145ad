"""Encoded textures as arrays and functions."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.array import Floats, Weights
from nacre.errors import NacreError
from nacre.geometry import cosine_hemisphere, join, split
from nacre.targets.textures import TextureAtlas
from nacre.targets.textures.accuracy import mean_squared_error
from nacre.targets.textures.atlas import atlas_shape, level_origin
from nacre.targets.textures.shader_texture import LARGEST
from nacre.textures.latent_file import save_latent_map
from nacre.textures.latent_map import LatentMap, NeuralBtf
from nacre.textures.mipmap import level_shapes
from tests.cli.support import run
from tests.mitsuba.textures.made import picture
from tests.oracles.runner import worst_error
from tests.oracles.runners import browser, slang
from tests.oracles.runners import three as pages
from tests.oracles.texture_runner import TEXTURE_RUNNERS, TextureRunner
from tests.oracles.texture_runner import exported as exported_by
from tests.oracles.textures import Points, TextureTruth, read_ktx2
from tests.targets.made_texture import HEIGHT, NAME, WIDTH, atlas, texture
from tests.targets.support import needs
from tests.textures.support import write_image
from tests.tiers import tiered

COUNT = 3000
WITH_PARALLAX = [name for name, each in TEXTURE_RUNNERS.items() if "parallax" in each.functions]
LEVELS = 3


@cache
def exported(target: str) -> Mapping[str, bytes]:
    return exported_by(target, texture(), atlas(), NAME)


@cache
def truth() -> TextureTruth:
    return TextureTruth(atlas().files(NAME), NAME, HEIGHT, WIDTH)


@cache
def fine() -> TextureTruth:
    """With a grid whose error is small beside what tells texels apart."""
    return TextureTruth(TextureAtlas.of(texture(), 12).files(NAME), NAME, HEIGHT, WIDTH)


@cache
def runner(name: str) -> TextureRunner:
    made = TEXTURE_RUNNERS[name]()
    needs(made.missing())
    return made


def points(seed: int = 0) -> Points:
    return Points.random(COUNT, LEVELS, seed)


@pytest.mark.parametrize("tool", TEXTURE_RUNNERS)
def test_functions_say_what_numpy_says(tool: str) -> None:
    run, at = runner(tool), points()
    files = exported(run.target), NAME
    assert worst_error(run.run(*files, "eval", at), truth().evaluate(at)) <= 1.0
    assert worst_error(run.run(*files, "pdf", at)[:, 0], truth().pdf(at)) <= 1.0


@pytest.mark.parametrize("tool", tiered(TEXTURE_RUNNERS, ["webgl", "onnxruntime", "opengl"]))
def test_samples_are_those_of_the_lobes_with_their_densities(tool: str) -> None:
    run, at = runner(tool), points(1)
    above = at.wo[:, 2] > 0.01
    u = np.random.default_rng(4).random((COUNT, 3), np.float32)
    drawn = run.run(exported(run.target), NAME, "sample", Points(at.uv, at.level, u, at.wo))
    view, numbers = (split(part.astype(np.float64)) for part in (at.wo, u))
    wi, _ = truth().lobe(at.uv).sample_components(view, numbers)
    away = np.abs(drawn[:, :3] - np.stack(wi, axis=1))[above].max(1)
    # Sines of Vulkan may be off by 2^-11; and u[0] may be the fraction itself.
    assert np.quantile(away, 0.999) < 1e-3
    expected = truth().pdf(Points(at.uv, at.level, drawn[:, :3], at.wo))
    assert worst_error(drawn[above, 3], expected[above]) <= 1.0


@pytest.mark.parametrize("tool", tiered(WITH_PARALLAX, WITH_PARALLAX[-2:]))
def test_views_meet_the_height_field(tool: str) -> None:
    run, at = runner(tool), points(2)
    found = run.run(exported(run.target), NAME, "parallax", at)
    away = np.abs(found - truth().parallax(at))[at.wo[:, 2] > 0.0].max(1)
    assert np.quantile(away, 0.99) < 1e-5  # a ray may graze a hill
    assert np.abs(found - at.uv).max() > 0.05


@pytest.mark.parametrize("level", range(LEVELS))
def test_texels_are_what_the_codec_decodes(level: int) -> None:
    found = fine()
    wi, wo = (steep(60, seed) for seed in (0, 1))
    rows, columns = level_shapes(HEIGHT, WIDTH)[level]
    decoded = texture().latent.codec.decoder(wi, wo)(texture().latent.codes.reshape(-1, 32))
    expected = decoded.reshape(HEIGHT, WIDTH, 60, 3)
    for axis, size in ((0, rows), (1, columns)):
        expected = area_means(expected, axis, size)
    y, x, pair = (part.ravel() for part in np.indices((rows, columns, 60)))
    uv = np.stack([(x + 0.5) / columns, (y + 0.5) / rows], axis=1)
    at = Points(uv, np.full(len(uv), level, np.float32), wi[pair], wo[pair])
    error = np.pi * found.evaluate(at) - expected.reshape(-1, 3)
    assert np.sqrt(np.mean(np.square(error))) < 0.06 * expected.mean()


def steep(count: int, seed: int) -> Weights:
    """Directions up to 70 degrees from the normal."""
    u = np.random.default_rng(seed).random((2, count))
    return join(cosine_hemisphere(0.88 * u[0], u[1])).astype(np.float32)


def area_means(values: Floats, axis: int, size: int) -> Floats:
    """Means over intervals of equal lengths along an axis, by many points of each."""
    count = values.shape[axis]
    fine = np.repeat(values, size, axis)
    shape = (*values.shape[:axis], size, count, *values.shape[axis + 1 :])
    return fine.reshape(shape).mean(axis + 1)


@pytest.mark.parametrize(
    ("height", "width"), [(1, 1), (5, 7), (64, 3), (3, 64), (1, 100), (33, 32)]
)
def test_levels_lie_apart_in_the_atlas(height: int, width: int) -> None:
    used = np.zeros(atlas_shape(height, width), int)
    for level, (rows, columns) in enumerate(level_shapes(height, width)):
        top, left = level_origin(height, width, level)
        used[top : top + rows, left : left + columns] += 1
    assert used.max() == 1
    assert used.sum() == sum(rows * columns for rows, columns in level_shapes(height, width))


def test_what_is_no_encoded_texture_is_refused() -> None:
    latent = texture().latent
    with pytest.raises(NacreError, match="not encoded; nacre fit encodes"):
        TextureAtlas.of(picture(np.ones((2, 2, 3))))
    wide = np.broadcast_to(latent.codes[:1, :1], (1, LARGEST + 1, latent.codes.shape[2]))
    with pytest.raises(NacreError, match=r"4097 x 1 texels .* the limit is 4096 x 4096"):
        TextureAtlas.of(LatentMap(wide, latent.codec, latent.wi, latent.wo, NAME))


def test_functions_say_what_their_arrays_are() -> None:
    for target in ("glsl", "wgsl", "slang"):
        files = exported(target)
        text = files[f"{NAME}.{target}"].decode()
        for path in files:
            assert path in text or path == f"{NAME}.{target}"
        assert f"{WIDTH} x {HEIGHT + HEIGHT // 2} x 32" in text
        assert "Error of the arrays against the codes: MSE x 1e4" in text


def test_facts_of_a_file_stay_in_comments() -> None:
    latent = texture().latent
    evil = '1\nfloat evil() { return 1.0; } /* "'
    errors = {"MSE x 1e4": evil, "relative RMSE": [evil]}
    named = LatentMap(
        latent.codes, latent.codec, latent.wi, latent.wo, evil, metadata={"errors": errors}
    )
    for target in ("glsl", "wgsl", "slang", "three"):
        files = exported_by(target, NeuralBtf(named), atlas(), NAME)
        content = b"".join(body for path, body in files.items() if not path.endswith(".ktx2"))
        assert b"evil() {" not in content
        assert b'/* "' not in content


@pytest.mark.parametrize("language", tiered([t for t in slang.TARGETS if t != "cpp"], ["wgsl"]))
def test_slang_modules_become_other_languages(language: str, tmp_path: Path) -> None:
    needs(slang.missing())
    source = {path: body for path, body in exported("slang").items() if path.endswith(".slang")}
    text = slang.shader(
        NAME, {"all": f"float4({NAME}_eval(a[id.x].xy, 0.5, a[id.x].xyz, b[id.x].xyz), 0)"}
    )
    assert slang.compiled(tmp_path, source, text, language, "all").stat().st_size


def test_arrays_are_files_that_another_reader_knows() -> None:
    needs(pages.missing())
    for path, content in atlas().files(NAME).items():
        found = parsed(content)
        pixels = read_ktx2(content)
        *layers, height, width, channels = pixels.shape
        assert found["format"] == {1: 76, 4: 97}[channels]  # VK_FORMAT_R16_SFLOAT and so on
        assert found["size"] == [width, height, layers[0] if layers else 0], path
        assert found["levels"] == [pixels.nbytes]
        assert found["samples"] == [[16 * k, 15] for k in range(channels)]
        assert found["plane"] == 2 * channels
        assert found["keys"] == ["KTXorientation", "KTXwriter"]
        assert found["first"] == pixels.view(np.uint16).ravel()[:8].tolist()


def parsed(content: bytes) -> dict[str, Any]:
    """What the parser that three.js brings along reads in a KTX 2.0 file."""
    script = b"""
        import { read } from "/three/examples/jsm/libs/ktx-parse.module.js";
        export async function parse() {
          const file = read(new Uint8Array(await (await fetch("/array.ktx2")).arrayBuffer()));
          const [block] = file.dataFormatDescriptor;
          const data = file.levels[0].levelData;
          return {
            format: file.vkFormat,
            size: [file.pixelWidth, file.pixelHeight, file.layerCount],
            levels: file.levels.map(({ levelData }) => levelData.byteLength),
            samples: block.samples.map(({ bitOffset, bitLength }) => [bitOffset, bitLength]),
            plane: block.bytesPlane[0],
            keys: Object.keys(file.keyValue),
            first: [...new Uint16Array(data.slice(0, 16).buffer)],
          };
        }"""
    files = {**pages.page(), "array.ktx2": content, "parse.js": script}
    found: dict[str, Any] = browser.compute(files, "parse.js", "parse")
    return found


def test_more_nodes_are_more_exact() -> None:
    latent = texture().latent
    coarse, fine = (mean_squared_error(TextureAtlas.of(latent, nodes), latent) for nodes in (4, 8))
    assert 0.0 < fine < 0.5 * coarse


def test_the_command_takes_a_height_field(tmp_path: Path, capsys: Any) -> None:
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    codes, image, folder = (tmp_path / name for name in ("cloth.safetensors", "h.png", "out"))
    save_latent_map(texture().latent, codes)
    write_image(image, np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8))
    given = "export", codes, "-o", f"{folder}/", "--height-field", image, "--depth", 0.2, "-q"
    assert run(*given, "--to", "glsl") == 0
    names = "weights", "functions", "lobes", "heights"
    assert {path.name for path in folder.iterdir()} == {
        f"{NAME}.glsl", *(f"{NAME}_{each}.ktx2" for each in names),
    }  # fmt: skip
    assert f"vec2 {NAME}_parallax(" in (folder / f"{NAME}.glsl").read_text()
    heights = read_ktx2((folder / f"{NAME}_heights.ktx2").read_bytes())
    assert heights.shape == (6, 8, 1)
    assert 0.05 < float(np.ptp(heights)) < 0.2
    for target, what in (("onnx", "has no parallax"), ("c", "takes no height field")):
        assert run(*given, "--to", target) == 2
        assert what in capsys.readouterr().err
