"""What the BiRD project's schemas 1.0 demand of the sections that nacre writes.

Written down from github.com/BiRD-project/BiRD_view (BRDF_JSON_schema, MIT) without the texts. As
published they can hold for no file, their own example included: `metadata` needs a `name` that it
does not allow, `phi_r` an `index` and a `type`, and polarizations a `unit`. These demands, and
that `metadata` has no `description`, are left out here.
"""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]

TEXT: Schema = {"type": "string"}
LENGTHS = ["pm", "nm", "μm", "mm", "dm", "m", "km", "Mm", "Gm"]


def section(required: str, **properties: Schema) -> Schema:
    return {
        "type": "object",
        "properties": properties,
        "required": required.split(),
        "additionalProperties": False,
    }


def quantity(*units: str) -> Schema:
    value: Schema = {"type": "number", "minimum": 0}
    both = {"value": value, "uncertainty": value}
    return section("value unit", **both, unit={"enum": [*units]}, uncertainty_unit=TEXT)


def variable(name: str, about: str, *units: str, limits: Schema | None = None) -> Schema:
    numbers = {"type": "number", "minimum": 0} | (limits or {})
    return section(
        "unit values",
        name={"const": name},
        description={"const": about},
        unit={"enum": [*units]},
        values={"type": "array", "items": numbers},
        uncertainty=section("value unit", value={"type": "number", "minimum": 0}, unit=TEXT),
        comments=TEXT,
    )


def angle(name: str, about: str, degrees: float, radians: float) -> Schema:
    def below(limit: float) -> Schema:
        return {"properties": {"values": {"items": {"exclusiveMaximum": limit}}}}

    return variable(name, about, "rad", "deg", "°") | {
        "if": {"properties": {"unit": {"const": "rad"}}},
        "then": below(radians),
        "else": below(degrees),
    }


LIGHT, VIEW = "Illumination light/beam incidence", "Reflected light/beam observation"
DATA = section(
    "theta_i phi_i theta_r phi_r BRDF",
    theta_i=angle("theta_i", f"{LIGHT} zenith angle.", 90, 1.5708),
    phi_i=angle("phi_i", f"{LIGHT} azimuthal angle.", 360, 3.141593),
    theta_r=angle("theta_r", f"{VIEW} zenith angle.", 90, 1.5708),
    phi_r=angle("phi_r", f"{VIEW} azimuthal angle.", 360, 3.141593),
    BRDF=variable("BRDF", "Bidirectional reflectance distribution function.", "1/sr", "sr^-1"),
    uBRDF=variable(
        "BRDF",
        "Uncertainty of bidirectional reflectance distribution function.",
        "1/sr", "sr^-1", "%",
    ),
    wavelength_i=variable("wavelength_i", "Illumination light wavelength.", "nm", "μm"),
    wavelength_r=variable("wavelength_r", "Observed reflected light wavelength.", "nm", "μm"),
    polarization_i={"type": "object"},
    polarization_r={"type": "object"},
    adhoc_variables={"type": "object"},
)  # fmt: skip

PROVENANCE = section(
    "organization location email contact_person",
    organization=TEXT,
    location=section(
        "country city street building_nr postal_code",
        **dict.fromkeys(
            [
                "country",
                "county",
                "city",
                "street",
                "building_nr",
                "room_nr",
                "postal_code",
                "coordinates",
            ],
            TEXT,
        ),
    ),
    **dict.fromkeys(["website", "email", "phone", "contact_person", "comments"], TEXT),
)
SAMPLE = section(
    "name type dimensions shape zero_azimuth_location",
    dimensions=section(
        "",
        **dict.fromkeys(
            [
                "length",
                "width",
                "height",
                "thickness",
                "radius",
                "diameter",
                "semi_major_axis",
                "semi_minor_axis",
            ],
            quantity(*LENGTHS),
        ),
    ),
    materials={"type": "array", "uniqueItems": True},
    data_links={"type": "array", "uniqueItems": True},
    adhoc_section={"type": "object"},
    **dict.fromkeys(
        [
            "name",
            "type",
            "manufacturer",
            "shape",
            "properties_symmetry",
            "origin_location",
            "zero_azimuth_location",
            "comments",
        ],
        TEXT,
    ),
)
METADATA = section(
    "schema id type timestamp provenance method instrumentation software sample environment",
    schema={"type": "string", "format": "uri"},
    id={"type": "string", "format": "uri"},
    type={"const": "BRDF"},
    timestamp={"type": "string", "pattern": r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d[+-]\d\d"},
    provenance=PROVENANCE,
    license=section("type rights_holder", **dict.fromkeys(["type", "link", "rights_holder"], TEXT)),
    description=TEXT,
    method={"enum": ["simulation", "measurement"]},
    instrumentation={"oneOf": [{"enum": ["NA"]}, {"type": "object"}]},
    software={
        "oneOf": [
            {"enum": ["NA"]},
            section("name", **dict.fromkeys(["name", "version", "author", "description"], TEXT)),
        ]
    },
    sample=SAMPLE,
    environment={"oneOf": [{"enum": ["NA"]}, {"type": "object"}]},
    data_links={"type": "array", "uniqueItems": True},
    comments=TEXT,
    adhoc_section={"type": "object"},
)
SCHEMA = section("metadata data", metadata=METADATA, data=DATA)
