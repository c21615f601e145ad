"""The denoiser: closer to the truth than what it is given, the same bits every time."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from nacre.errors import MissingExtraError
from nacre.mitsuba import preview
from nacre.mitsuba.denoise import can_denoise, denoise
from nacre.mitsuba.preview import DENOISED_SPP, PLAIN_SPP, default_spp, render_preview
from tests.mitsuba.reflectances import Constant, Lobe

needs_denoiser = pytest.mark.skipif(not can_denoise(), reason="needs pyoidn (extra 'render')")


@needs_denoiser
def test_noise_goes_and_edges_stay() -> None:
    random = np.random.default_rng(0)
    clean = np.full((64, 64, 3), 0.2, np.float32)
    clean[:, 32:] = 0.8
    noisy = clean * random.exponential(1.0, clean.shape).astype(np.float32)
    normals = np.broadcast_to(np.float32([0, 0, 1]), clean.shape)
    found, again = (denoise(noisy, clean, normals) for _ in range(2))
    assert found.dtype == np.float32
    assert np.abs(found - clean).mean() < 0.1 * np.abs(noisy - clean).mean()
    assert np.abs(np.diff(found[8:-8, 31:33].mean(axis=0), axis=0)).min() > 0.4
    np.testing.assert_array_equal(found, again)


@needs_denoiser
def test_a_preview_is_nearer_to_many_samples(rgb: Any) -> None:
    settings: dict[str, Any] = {"shape": "sphere", "size": 48}
    truth = render_preview(Lobe(40.0), spp=1024, denoise=False, seed=7, **settings)
    plain, clean = (
        render_preview(Lobe(40.0), spp=8, denoise=chosen, **settings) for chosen in (False, True)
    )
    plain_error, error = (np.square((p - truth) / (truth + 0.1)).mean() for p in (plain, clean))
    assert error < 0.5 * plain_error
    assert clean.mean() == pytest.approx(truth.mean(), rel=0.05)


@needs_denoiser
def test_pytorch_is_not_loaded_for_it() -> None:
    code = (
        "import sys, numpy as np; from nacre.mitsuba.denoise import denoise\n"
        "black = np.zeros((16, 16, 3), np.float32); denoise(black, black, black)\n"
        "assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_without_the_denoiser_there_are_more_samples(
    rgb: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(preview, "can_denoise", lambda: False)
    assert default_spp() == PLAIN_SPP > DENOISED_SPP
    seen: list[float] = []
    render_preview(Constant(0.5), "sphere", size=8, progress=seen.append)
    assert len(seen) == -(-PLAIN_SPP // 16)
    monkeypatch.setattr(sys, "path", [])
    if "pyoidn" not in sys.modules:
        with pytest.raises(MissingExtraError, match=r"render"):
            denoise(*np.zeros((3, 4, 4, 3), np.float32))
