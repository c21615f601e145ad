"""What every analytic model keeps."""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import nacre.formats
from nacre.analytic import MODELS, AnalyticBrdf
from nacre.testing.brdf import check_brdf
from nacre.testing.cases import Checks, Contracts, pairs, refused

CONTRACTS = Contracts()


def check_model(
    model: type[AnalyticBrdf], values: Mapping[str, Any] | None = None, **options: Any
) -> Checks:
    """Contracts of an analytic model: its parameters, its file, and those of reflectances.

    Parameters
    ----------
    model
        The class. A file is written if it is registered under its name.
    values
        Parameters of the material that is checked; the middle of where fits start if None.
    options
        As :func:`nacre.testing.check_brdf` takes them.
    """
    made = functools.cache(functools.partial(_material, model, dict(values or {})))
    yield from CONTRACTS.of(made)
    yield from check_brdf(made, **options)


def _material(model: type[AnalyticBrdf], values: dict[str, Any]) -> AnalyticBrdf:
    given = values or {p.name: _at(p, 0.5) for p in model.parameters}
    return model(name="checked", **given)


def _at(parameter: Any, fraction: float) -> Any:
    value = float(parameter.at(fraction))
    return (
        (value, 0.8 * value + 0.2 * float(parameter.at(0.3)), value) if parameter.color else value
    )


@CONTRACTS.add
def _all_of_where_fits_start_gives_finite_values(brdf: AnalyticBrdf) -> None:
    wi, wo = pairs(500)
    random = np.random.default_rng(3)
    for _ in range(20):
        values: dict[str, Any] = dict(brdf.values)
        values |= {p.name: _at(p, float(random.random())) for p in brdf.parameters}
        found = type(brdf)(**values).eval(wi, wo)
        assert np.isfinite(found).all(), values
        assert (found >= 0.0).all(), values


@CONTRACTS.add
def _values_out_of_bounds_are_refused(brdf: AnalyticBrdf) -> None:
    for parameter in brdf.numbers():
        values: dict[str, Any] = dict(brdf.values)
        low = min(parameter.low, (getattr(parameter, "allowed", None) or (np.inf,))[0])
        bad = np.full(parameter.shape, low - 1.0).tolist()
        refused(
            ValueError, functools.partial(type(brdf), **values | {parameter.name: bad}),
            words=f"{parameter.name} must lie in",
        )  # fmt: skip
        del values[parameter.name]
        refused(ValueError, functools.partial(type(brdf), **values), words="lacks")
    more: dict[str, Any] = {**brdf.values, "none": 1.0}
    refused(ValueError, functools.partial(type(brdf), **more), words="has no none")


@CONTRACTS.add
def _a_file_reads_back_the_same(brdf: AnalyticBrdf) -> None:
    if MODELS.get(brdf.model) is not type(brdf):
        return
    with tempfile.TemporaryDirectory(prefix="nacre-testing-") as folder:
        path = Path(folder) / "checked.json"
        nacre.formats.save(brdf, path)
        again = nacre.formats.load(path)
    assert isinstance(again, type(brdf))
    assert dict(again.values) == dict(brdf.values)
    wi, wo = pairs(200)
    np.testing.assert_array_equal(again.eval(wi, wo), brdf.eval(wi, wo))
