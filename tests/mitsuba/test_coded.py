"""The plugin `nbrdf` of a code: the material, its gradients, and no kernel compiled again."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.latent import pretrained_basis, save_basis, save_code
from nacre.mitsuba.plugins import register
from tests.latent.made import basis as pca_basis
from tests.variants import by_precision, require_mitsuba

CODE = pretrained_basis().examples[40].astype(float)
KEY = "shape.bsdf.code"


@pytest.fixture
def mi() -> Any:
    found = require_mitsuba()
    register()
    return found


def scene(mi: Any, bsdf: Any = None, **material: Any) -> Any:
    camera = mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 12, "height": 12, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": 26, "to_world": camera, "film": film}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct"},
            "light": {"type": "point", "position": [2, 3, 4], "intensity": 20.0},
            "sensor": sensor,
            "shape": {"type": "sphere", "bsdf": bsdf or {"type": "nbrdf", **material}},
        }
    )


def text(code: Any) -> str:
    return ", ".join(map(str, code))


def test_a_code_looks_like_the_network_that_it_decodes_into(mi, tmp_path):
    decoded = pretrained_basis().decode(CODE, "seven")
    save_code(decoded, tmp_path / "code.json")
    save_basis(pretrained_basis(), tmp_path / "basis.safetensors")
    one = mi.render(scene(mi, code=text(CODE)), spp=4)
    named = {"code": str(tmp_path / "code.json"), "basis": str(tmp_path / "basis.safetensors")}
    other = mi.render(scene(mi, **named), spp=4)
    expected = np.array(mi.render(scene(mi, nacre.mitsuba.bsdf(decoded)), spp=4))
    assert expected.max() > 0.05
    for image in (one, other):
        np.testing.assert_allclose(np.array(image), expected, rtol=by_precision(2e-3), atol=1e-5)


@pytest.mark.slow
def test_gradients_are_those_of_differences_and_no_kernel_is_compiled_again(mi):
    import drjit as dr

    made = scene(mi, code=text(CODE))
    parameters = mi.traverse(made)

    def loss(code: Any, gradient: bool = False) -> tuple[float, Any]:
        parameters[KEY] = mi.Float(code)
        if gradient:
            dr.enable_grad(parameters[KEY])
        parameters.update()
        value = dr.mean(dr.log(mi.render(made, parameters, spp=128, seed=2).array + 0.1))
        if gradient:
            dr.backward(value)
            return float(value[0]), np.array(dr.grad(parameters[KEY]))
        return float(value[0]), None

    _, slopes = loss(CODE, gradient=True)
    assert np.abs(slopes).max() > 1e-2
    for index in (0, 3, 24):
        step = 0.02 * np.eye(len(CODE))[index]
        difference = (loss(CODE + step)[0] - loss(CODE - step)[0]) / 0.04
        assert slopes[index] == pytest.approx(difference, rel=0.03, abs=2e-4)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        loss(CODE + 0.05, gradient=True)
        kernels = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
    assert kernels
    assert all(kernel["cache_hit"] for kernel in kernels)


def test_what_is_refused(mi, tmp_path):
    path = tmp_path / "other.json"
    path.write_text(json.dumps({"model": "ggx"}))
    save_basis(pca_basis(), tmp_path / "pca.safetensors")
    for problem, material in {
        "32 values below a million": {"code": "1, 2"},
        "could not convert": {"code": "gold"},
        "is not a code": {"code": str(path)},
        "not both": {"code": text(CODE), "filename": "x.safetensors"},
        "neural basis; this one is 'pca'": {
            "code": text(CODE),
            "basis": str(tmp_path / "pca.safetensors"),
        },
    }.items():
        with pytest.raises(Exception, match=problem):
            scene(mi, **material)
