"""Reflectances that are not isotropic as they say are found before anything relies on it."""

import pytest

import nacre
from nacre.analytic import MODELS, AnisotropicGgx, Ggx
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.neural import Recipe, fit, fit_many
from nacre.sampling import check_isotropic
from tests.analytic.materials import EXAMPLES
from tests.reflectances import Brushed, Glossy
from tests.scans import scan


class Grooves(Brdf):
    """Brighter along x; its class forgets to say that it is anisotropic."""

    name = "grooves"

    def eval_components(self, wi, wo):
        along = wi[0] * wi[0] + wo[0] * wo[0]
        f = 0.10 + 0.18 * along / (1e-9 + along + wi[1] * wi[1] + wo[1] * wo[1])
        return f, f, f


class Woven(Brdf):
    """Unchanged by a quarter turn, but by no other."""

    def eval_components(self, wi, wo):
        f = 0.2 + 0.5 * (wi[0] * wi[1]) ** 2
        return f, f, f


class Brushes(AnisotropicGgx):
    """A narrow highlight that is longer one way."""

    isotropic = True
    model = "brushes"


BRUSHES = Brushes(
    diffuse=(0.1,) * 3, specular=(0.5,) * 3, roughness_x=0.02, roughness_y=0.04, angle=0.3
)


@pytest.mark.parametrize("brdf", [Grooves(), Woven(), BRUSHES])
def test_false_claims_are_found(brdf):
    with pytest.raises(NacreError, match=r"says that it is isotropic, .* set isotropic = False"):
        check_isotropic(brdf)


@pytest.mark.parametrize(
    "brdf",
    [
        Brushed(),
        Glossy(0.1, 0.5, 0.03),
        Ggx(diffuse=(0.1,) * 3, specular=(1.0,) * 3, roughness=1e-3),
        scan(Glossy(0.2, 0.1, 0.3), 200),
        *EXAMPLES.values(),
    ],
    ids=lambda brdf: type(brdf).__name__,
)
def test_true_ones_pass(brdf):
    check_isotropic(brdf)


def test_nothing_is_fitted_or_written_that_the_claim_would_spoil(tmp_path):
    grooves, match = Grooves(), "set isotropic = False"
    with pytest.raises(NacreError, match=match):
        fit(grooves)
    with pytest.raises(NacreError, match=match):
        nacre.analytic.fit(grooves, MODELS["ggx"])
    for ending in ("binary", "npz", "bsdf", "csv"):
        with pytest.raises(NacreError, match=match):
            nacre.save(grooves, tmp_path / f"x.{ending}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("given", ["x.bsdf", 3, None])
def test_what_is_no_reflectance_is_named(given):
    words = r"nacre\.load\('x\.bsdf'\)" if given == "x.bsdf" else f"got {type(given).__name__}"
    for call in (fit, lambda brdf: nacre.analytic.fit(brdf, MODELS["ggx"])):
        with pytest.raises(TypeError, match=words):
            call(given)
    pytest.importorskip("torch")
    ((_, result),) = fit_many([given], Recipe(epochs=1), device="cpu")
    assert isinstance(result, TypeError)
