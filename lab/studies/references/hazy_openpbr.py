"""OpenPBR with the `specular_haze` of version 1.2, and with a second lobe that is freer still.

The specification (Academy Software Foundation, OpenPBR, pull request 254, section "Specular haze")
makes the base (1 - w) f_core + w f_haze, where w is `specular_haze` and f_haze has the roughness
r + s (1 - r) in place of `specular_roughness` r, with s as `specular_haze_spread`. Anisotropy is
the same in both. A rough coat widens both. As in the reference MaterialX graph (pull request 298),
each lobe has its own albedo and compensation, and what they let through to the diffuse base is
mixed alike.

All of this is linear in w, as are the layers above the base. So a material with haze is exactly the
mixture of two materials without, and the formula is written as that.
"""

from __future__ import annotations

from nacre.analytic.model import Parameter, Values
from nacre.array import Components
from nacre.standard.openpbr import OpenPbr
from nacre.standard.parameter_math import color_parameter, fraction

HAZE, SPREAD = "specular_haze", "specular_haze_spread"


def wider(roughness: float, spread: float) -> float:
    """Roughness of the haze, in [0, 1]."""
    return roughness + spread * (1.0 - roughness)


def _mixture(values: Values, second: Values, wi: Components, wo: Components) -> Components:
    first, other = (OpenPbr.formula(each, wi, wo) for each in (values, second))
    red, green, blue = (a + values[HAZE] * (b - a) for a, b in zip(first, other, strict=True))
    return red, green, blue


class HazyOpenPbr(OpenPbr):
    """OpenPBR Surface 1.1 with the haze of 1.2: `specular_haze` 0 is :class:`OpenPbr`."""

    model = "openpbr-haze"
    parameters = (*OpenPbr.parameters, fraction(HAZE), fraction(SPREAD))

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        roughness = wider(values["specular_roughness"], values[SPREAD])
        return _mixture(values, {**values, "specular_roughness": roughness}, wi, wo)


_SECOND = "second_"
_FREE: tuple[Parameter, ...] = (
    fraction("second_base_metalness", (0.0, 1.0)),
    fraction("second_specular_weight", (0.0, 1.0)),
    color_parameter("second_specular_color", (0.5, 0.98)),
    fraction("second_specular_roughness", (0.1, 0.8)),
    Parameter("second_specular_ior", 1.0, 3.0, (1.3, 1.8)),
)


class TwoLobeOpenPbr(OpenPbr):
    """A mixture of two bases whose lobes share nothing: what haze can gain at most.

    `specular_haze` is the weight of the second base, whose parameters begin with `second_`. The
    base's color and the layers above are shared.
    """

    model = "openpbr-two-lobes"
    parameters = (*OpenPbr.parameters, fraction(HAZE), *_FREE)

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        second = {p.name.removeprefix(_SECOND): values[p.name] for p in _FREE}
        return _mixture(values, {**values, **second}, wi, wo)

    @staticmethod
    def of_haze(values: Values) -> dict[str, object]:
        """The same material, from values of :class:`HazyOpenPbr`."""
        second = {p.name: values[p.name.removeprefix(_SECOND)] for p in _FREE}
        roughness = wider(values["specular_roughness"], values[SPREAD])
        kept = {name: value for name, value in values.items() if name != SPREAD}
        return {**kept, **second, "second_specular_roughness": roughness}
