"""Passes of pictures, and wavefronts, which show the same."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.mitsuba import passes
from nacre.mitsuba.passes import (
    PASS,
    Plan,
    accumulate,
    needs_wavefronts,
    pass_sizes,
    plan_passes,
)
from nacre.mitsuba.preview import render_scene
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.mitsuba.textures.scene import describe_texture_scene
from nacre.runtime.store import Store
from tests.textures.codecs.basis.made import codec as basis_codec
from tests.variants import by_precision

from .textures.made import latent, picture


def scene(mi: Any, size: int) -> Any:
    pixels = np.random.default_rng(0).random((4, 4, 3)).astype(np.float32)
    return mi.load_dict(describe_texture_scene(texture_bsdf(picture(pixels)), size=(size, size)))


def test_passes_stop_at_counts() -> None:
    assert pass_sizes([3, 40]) == [3, PASS, PASS, 5]
    assert pass_sizes([5], 2) == [2, 2, 1]


def test_interrupts_wait_for_passes(rgb: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    shown, render = scene(rgb, 8), rgb.render
    passes: list[int] = []

    def interrupted(*arguments: Any, **options: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        passes.append(options["spp"])
        return render(*arguments, **options)

    monkeypatch.setattr(rgb, "render", interrupted)
    with pytest.raises(KeyboardInterrupt):
        render_scene(shown, PASS + 1)
    assert passes == [PASS]


@pytest.mark.parametrize(
    ("size", "wavefront", "expected"),
    [
        (32, True, Plan(PASS, 32)),
        (1024, True, Plan(2, 1024)),
        (2048, True, Plan(1, 1024)),
        (512, False, Plan(PASS, 512)),
        (8192, False, Plan(1, 2048)),
    ],
)
def test_passes_are_as_large_as_memory_allows(
    monkeypatch: pytest.MonkeyPatch, size: int, wavefront: bool, expected: Plan
) -> None:
    monkeypatch.setattr(passes, "available_memory", lambda: 1 << 40)
    assert plan_passes(size, size, 64, wavefront) == expected


def test_a_picture_beyond_memory_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(passes, "available_memory", lambda: 1 << 30)
    with pytest.raises(
        NacreError, match=r"8192 x 8192 .* 8\.5 GiB .* 1\.0 GiB are left: render 28"
    ):
        plan_passes(8192, 8192, 64)


def test_bands_of_rows_make_the_whole_picture(rgb: Any) -> None:
    described = describe_texture_scene({"type": "diffuse"}, size=(24, 20))
    described["sensor"]["film"] |= {"rfilter": {"type": "box"}}
    shown = rgb.load_dict(described)
    ((_, whole),) = accumulate(shown, [64], 1)
    ((_, banded),) = accumulate(shown, [64], 1, rows=7)
    ((_, other),) = accumulate(shown, [64], 2)
    assert np.abs(banded - whole).mean() < 1.5 * np.abs(other - whole).mean()
    assert list(shown.sensors()[0].film().crop_size()) == [24, 20]


def test_a_picture_that_was_stopped_goes_on(
    rgb: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In another process, from the part that was not finished."""
    monkeypatch.setattr(passes, "SAVE_EVERY", 0.0)
    shown, state = scene(rgb, 8), tmp_path / "picture.state"
    ((_, _), (_, expected)) = accumulate(shown, [4, 4], 1, rows=3)
    render, calls = rgb.render, []

    def interrupted(*arguments: Any, **options: Any) -> Any:
        calls.append(options["seed"])
        if len(calls) == 4:
            signal.raise_signal(signal.SIGINT)
        return render(*arguments, **options)

    monkeypatch.setattr(rgb, "render", interrupted)
    with pytest.raises(KeyboardInterrupt):
        list(accumulate(shown, [4, 4], 1, rows=3, store=Store(state, "of this picture")))
    with pytest.raises(NacreError, match="belongs to another run"):
        list(accumulate(shown, [4, 4], 1, rows=3, store=Store(state, "of another")))
    *_, (done, found) = accumulate(shown, [4, 4], 1, rows=3, store=Store(state, "of this picture"))
    np.testing.assert_allclose(found, expected, rtol=1e-5)
    assert done == 8
    assert len(calls) == len(set(calls)) == 6
    with pytest.raises(NacreError, match="remove it to start over"):
        list(accumulate(shown, [4], 1, store=Store(state, "of this picture")))


def test_wavefronts_show_what_whole_paths_do(rgb: Any) -> None:
    import drjit as dr

    codec = basis_codec(1)
    codes = latent(np.random.default_rng(0).normal(size=(4, 4, codec.code_dim)), codec)
    bsdf = texture_bsdf(codes, decoder="network")
    shown = rgb.load_dict(describe_texture_scene(bsdf, size=(24, 24)))
    assert needs_wavefronts(shown)
    assert not needs_wavefronts(scene(rgb, 24))
    ((_, expected),) = accumulate(shown, [4], 3)
    flags = dr.JitFlag.SymbolicLoops, dr.JitFlag.SymbolicCalls
    np.testing.assert_allclose(
        render_scene(shown, 4, seed=3), expected, atol=by_precision(1e-5, 1e-2)
    )
    assert all(dr.flag(flag) for flag in flags)
    assert expected.std() > 0.05
