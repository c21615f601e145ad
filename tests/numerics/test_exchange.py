"""What counts as an array, and of which library the results are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.brdf import Brdf
from nacre.numerics.exchange import any_library, numbers
from tests.contracts.materials import MATERIALS


class Foreign:
    """An array of a library of its own, with what DLPack and the array API ask for."""

    def __init__(self, values: Any, device: tuple[int, int] = (1, 0)) -> None:
        self.values, self._device = np.asarray(values), device

    def __dlpack__(self, **options: Any) -> Any:
        if self._device[0] != 1 and options.get("dl_device") != (1, 0):
            raise BufferError("on a device")
        return self.values.__dlpack__()

    def __dlpack_device__(self) -> tuple[int, int]:
        return self._device

    def __array_namespace__(self) -> Any:
        return Library


class Library:
    """Its functions."""

    @staticmethod
    def asarray(values: Any) -> Foreign:
        return Foreign(values)


class Bare:
    """One that only lends its memory."""

    def __init__(self, values: Any) -> None:
        self.values = np.asarray(values)

    def __dlpack__(self, **options: Any) -> Any:
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.values.__dlpack_device__()


class Distant(Foreign):
    """On a device, without a way to the CPU but its own."""

    def __init__(self, values: Any) -> None:
        super().__init__(values, (2, 0))

    def __dlpack__(self, **options: Any) -> Any:
        raise BufferError("no")

    def get(self) -> Any:
        return self.values


@pytest.fixture
def brdf() -> Brdf:
    return MATERIALS["isotropic network"]()


@pytest.mark.parametrize("made", [Foreign, Distant, lambda v: Foreign(v, (2, 0))])
def test_results_are_of_the_library_that_was_given(brdf: Brdf, made: Any) -> None:
    wo, u = np.float32([[0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]), np.full((2, 3), 0.3, np.float32)
    given = made(wo)
    for found, expected in (
        (brdf.eval(given, [0, 0, 1]), brdf.eval(wo, [0, 0, 1])),
        (brdf.eval(wi=wo, wo=given), brdf.eval(wo, wo)),
        (brdf.valid(given, given), brdf.valid(wo, wo)),
        (brdf.pdf(given, [0, 0, 1]), brdf.pdf(wo, [0, 0, 1])),
        (brdf.sample(given, u)[0], brdf.sample(wo, u)[0]),
        (brdf.sample(given, n=4, rng=3)[1], brdf.sample(wo, n=4, rng=3)[1]),
        (brdf.albedo(given), brdf.albedo(wo)),
    ):
        assert isinstance(found, Foreign)
        np.testing.assert_array_equal(found.values, expected)
        assert found.values.dtype == expected.dtype


def test_a_library_that_makes_no_arrays_gets_those_of_numpy(brdf: Brdf) -> None:
    wo = np.float64([0.0, 0.0, 1.0])
    found = brdf.eval(Bare(wo), Bare(wo))
    assert isinstance(found, np.ndarray)
    assert found.dtype == np.float64


def test_tensors_go_to_what_takes_them_where_they_are() -> None:
    torch = pytest.importorskip("torch", reason="needs the extra 'torch'")

    class Shared(Bare):
        """As on a graphics card; only PyTorch takes it from there."""

        def __dlpack_device__(self) -> tuple[int, int]:
            return (1, 0)

    class Owner:
        traceable = True

        @any_library(on_device=True)
        def kind(self, array: Any) -> str:
            return type(array).__name__

    assert Owner().kind(Shared([1.0])) == "ndarray"
    assert Owner().kind(torch.zeros(3)) == "Tensor"
    assert Owner().kind([1.0]) == "list"


def test_an_array_that_cannot_be_copied_says_so(
    brdf: Brdf, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(Distant, "get")
    monkeypatch.setattr("nacre.numerics.exchange._torch_takes", lambda array: False)
    with pytest.raises(TypeError, match="copy it to the CPU, or install PyTorch"):
        brdf.eval(Distant([0.0, 0.0, 1.0]), [0, 0, 1])


@pytest.mark.parametrize(
    ("given", "dtype"),
    [
        ([0, 0, 1], np.float32),
        ([0, 0.0, 1.0], np.float32),
        ((0.0, 0.6, 0.8), np.float32),
        (np.array([0, 0, 1]), np.float32),
        (np.float16([0, 0, 1]), np.float16),
        (np.array([0.0, 0.0, 1.0]), np.float64),
    ],
)
def test_numbers_have_one_rule(brdf: Brdf, given: Any, dtype: type) -> None:
    assert numbers(given).dtype == dtype
    wanted = np.float64 if dtype == np.float64 else np.float32
    assert brdf.eval(given, [0, 0, 1]).dtype == wanted
    assert brdf.pdf(given, [0.0, 0.0, 1.0]).dtype == wanted
    assert {a.dtype for a in brdf.sample(given, rng=0)} == {np.dtype(wanted)}
    assert brdf.albedo(given).dtype in (wanted, dtype)
