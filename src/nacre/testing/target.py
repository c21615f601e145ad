"""What every export target keeps."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import cached_property

import numpy as np

from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.neural import NeuralBrdf
from nacre.neural.training import initial_layers
from nacre.targets import Target, identifier
from nacre.targets.target import TEXTURES
from nacre.testing.cases import Checks, Contracts, maker, refused
from nacre.testing.codec import made_texture

CONTRACTS = Contracts()
_HOSTILE = '*/ "); system("x") --> \\ \n #{x} Ünï'


def check_target(target: Target | type[Target]) -> Checks:
    """Contracts of an export target: names and bytes of its files, and what it refuses.

    Whether the code computes what nacre does, only a test that runs it can tell.

    Parameters
    ----------
    target
        The target, or its class.
    """
    made = maker(target, Target)
    return CONTRACTS.of(lambda: _Case(made()))


class _Case:
    """A target, and materials as it holds them."""

    def __init__(self, target: Target) -> None:
        self.target = target

    def files(self, brdf: Brdf, name: str = "made") -> dict[str, bytes]:
        return dict(self.target.files(brdf, name))

    @cached_property
    def held(self) -> Mapping[str, Brdf]:
        """The materials that the target takes, as it holds them; at least one."""
        found: dict[str, Brdf] = {}
        for what, brdf in _materials().items():
            if self.target.model and found:  # another fit would show nothing else
                break
            with suppress(NacreError):
                held = self.target.held(brdf)
                self.files(held)
                found[what] = held
        assert found, "it takes neither a formula nor a network"
        return found


def _materials() -> Mapping[str, Brdf]:
    glossy = MODELS["ggx"](diffuse=(0.3, 0.2, 0.1), specular=(0.3, 0.3, 0.3), roughness=0.4)
    return {"a formula": glossy.replaced(name="glossy"), "a network": _network(0)}


def _network(seed: int) -> NeuralBrdf:
    return NeuralBrdf(initial_layers((21, 21), seed), name="network")


@CONTRACTS.add
def _it_has_a_title(case: _Case) -> None:
    assert case.target.title.strip()
    assert "\n" not in case.target.title


@CONTRACTS.add
def _files_are_named_after_the_material(case: _Case) -> None:
    for what, brdf in case.held.items():
        files = case.files(brdf, "made_material")
        assert files, what
        for name, content in files.items():
            assert name.startswith("made_material"), name
            assert isinstance(content, bytes), name
            assert content, name


@CONTRACTS.add
def _the_same_material_gives_the_same_bytes(case: _Case) -> None:
    for what, brdf in case.held.items():
        assert case.files(brdf) == case.files(brdf), what


@CONTRACTS.add
def _another_material_gives_other_bytes(case: _Case) -> None:
    for brdf in case.held.values():
        if isinstance(brdf, NeuralBrdf):
            assert case.files(brdf) != case.files(_network(1))


@CONTRACTS.add
def _a_hostile_name_does_not_get_into_the_code(case: _Case) -> None:
    for what, brdf in case.held.items():
        named = brdf.replaced(name=_HOSTILE)
        for name, content in case.files(named, identifier(_HOSTILE)).items():
            assert name.isascii(), (what, name)
            assert b'system("x")' not in content, (what, name)


@CONTRACTS.add
def _textures_are_refused_if_it_does_not_hold_them(case: _Case) -> None:
    if TEXTURES not in case.target.holds:
        error = refused(NacreError, case.target.files, made_texture(0), "made")
        assert "\n" not in str(error)


@CONTRACTS.add
def _numbers_do_not_change_the_material(case: _Case) -> None:
    wi, wo = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.28, 0.96])
    for what, brdf in case.held.items():
        before = brdf.eval(wi, wo)
        case.files(brdf)
        np.testing.assert_array_equal(brdf.eval(wi, wo), before, err_msg=what)
