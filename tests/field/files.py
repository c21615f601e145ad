"""Every file of `field/` among the real data: whether it is read, and what its values are checked
against.
"""

from __future__ import annotations

from dataclasses import dataclass

_TABLES = "tests/measured/test_real_tables.py"
_KLEMS = "tests/measured/test_klems.py"
_MATERIALX = "tests/standard/test_materialx_real_files.py"


@dataclass(frozen=True)
class Real:
    """One real file.

    Parameters
    ----------
    file
        Its place in the folder of real files.
    checked, test
        What the values are compared with, and the test that does it; empty where none are read.
    refused
        Words of the message that refuses it; empty where it is read.
    opaque_part
        Whether `opaque_part=True` reads it all the same.
    """

    file: str
    checked: str = ""
    test: str = ""
    refused: str = ""
    opaque_part: bool = False


REAL: tuple[Real, ...] = (
    Real("bird/example.brdf", checked="mean over both polarizations, by JSON alone", test=_TABLES),
    Real(
        "fred/AnoBlackEC1onAlum.txt",
        checked="samples of every 17th line, and the Zemax file of the same sample",
        test=_TABLES,
    ),
    Real(
        "fred/AnoBlackEC1onAlum_fullAz.txt",
        checked="samples of every 17th line, and the Zemax file of the same sample",
        test=_TABLES,
    ),
    Real(
        "goniometer/20250409_S7_swir_sample.txt",
        checked="all rows, by the text alone",
        test=_TABLES,
    ),
    Real(
        "goniometer/test_brdf_viewer_2D_data.csv",
        checked="all rows, by the text alone",
        test=_TABLES,
    ),
    Real("goniometer/test_jdv.jdv", refused="raw signals of an RT-300S"),
    Real("goniometer/test_lighttools.txt", refused="raw signals of an RT-300S"),
    Real("goniometer/test_speos.rtd", refused="version 1 has another layout"),
    Real(
        "klems/2011-SA1-Small-TabSeparated.XML",
        refused="holds no reflection, but Transmission Back, Transmission Front",
    ),
    Real(
        "klems/2011-SA1.XML", checked="400 pairs by Radiance's library, and the text", test=_KLEMS
    ),
    Real(
        "materialx/disney_principled_carpaint.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/disney_principled_glass.mtlx",
        refused="transmission is not read",
        opaque_part=True,
    ),
    Real(
        "materialx/disney_principled_plastic.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/gltf_pbr_carpaint.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real("materialx/gltf_pbr_glass.mtlx", refused="transmission is not read", opaque_part=True),
    Real(
        "materialx/gltf_pbr_plastic.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/open_pbr_carpaint.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real("materialx/open_pbr_glass.mtlx", refused="transmission is not read", opaque_part=True),
    Real(
        "materialx/open_pbr_ketchup.mtlx",
        refused="subsurface scattering is not read",
        opaque_part=True,
    ),
    Real(
        "materialx/open_pbr_pearl.mtlx",
        refused="subsurface scattering is not read",
        opaque_part=True,
    ),
    Real(
        "materialx/open_pbr_velvet.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real("materialx/standard_surface_brass_tiled.mtlx", refused="is a texture", opaque_part=True),
    Real(
        "materialx/standard_surface_carpaint.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/standard_surface_chrome.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/standard_surface_default.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/standard_surface_glass_tinted.mtlx",
        refused="transmission is not read",
        opaque_part=True,
    ),
    Real(
        "materialx/standard_surface_greysphere.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/standard_surface_jade.mtlx",
        refused="subsurface scattering is not read",
        opaque_part=True,
    ),
    Real("materialx/standard_surface_look_wood_tiled.mtlx", refused="includes another file"),
    Real(
        "materialx/standard_surface_metal_brushed.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/standard_surface_plastic.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/standard_surface_velvet.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/usd_preview_surface_brass_tiled.mtlx", refused="is a texture", opaque_part=True
    ),
    Real(
        "materialx/usd_preview_surface_default.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "materialx/usd_preview_surface_gold.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openmaterial/example_material.xomp",
        checked="rows of the table, by JSON alone",
        test=_TABLES,
    ),
    Real(
        "openmaterial/example_material_camera_brdf.xompt",
        checked="rows of the table, by JSON alone",
        test=_TABLES,
    ),
    Real(
        "openmaterial/example_material_emp.xompt",
        refused="holds electromagnetic properties, no reflectance",
    ),
    Real(
        "openmaterial/example_material_optical.xompt",
        refused="holds indices of refraction, no reflectance",
    ),
    Real(
        "openpbr/open_pbr_aluminum_brushed.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_blackboard.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_brass.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_carpaint.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_charcoal.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_chromium.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real("openpbr/open_pbr_coffee.mtlx", refused="transmission is not read", opaque_part=True),
    Real("openpbr/open_pbr_cooking_oil.mtlx", refused="transmission is not read", opaque_part=True),
    Real(
        "openpbr/open_pbr_default.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_egg_shell.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real("openpbr/open_pbr_eye_lens.mtlx", refused="transmission is not read", opaque_part=True),
    Real("openpbr/open_pbr_gasoline.mtlx", refused="transmission is not read", opaque_part=True),
    Real("openpbr/open_pbr_glass.mtlx", refused="transmission is not read", opaque_part=True),
    Real(
        "openpbr/open_pbr_gray_card.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_honey_liquid.mtlx", refused="transmission is not read", opaque_part=True
    ),
    Real(
        "openpbr/open_pbr_iridium.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_ketchup.mtlx",
        refused="subsurface scattering is not read",
        opaque_part=True,
    ),
    Real(
        "openpbr/open_pbr_lead.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_light_bulb_5000k.mtlx", refused="emission is not read", opaque_part=True
    ),
    Real(
        "openpbr/open_pbr_magnesium.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_marble.mtlx",
        refused="subsurface scattering is not read",
        opaque_part=True,
    ),
    Real(
        "openpbr/open_pbr_milk.mtlx", refused="subsurface scattering is not read", opaque_part=True
    ),
    Real(
        "openpbr/open_pbr_nickel.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_palladium.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_petroleum.mtlx",
        refused="subsurface scattering is not read",
        opaque_part=True,
    ),
    Real("openpbr/open_pbr_plastic_pc.mtlx", refused="transmission is not read", opaque_part=True),
    Real(
        "openpbr/open_pbr_plastic_polyurethane.mtlx",
        refused="transmission is not read",
        opaque_part=True,
    ),
    Real("openpbr/open_pbr_plastic_pvc.mtlx", refused="transmission is not read", opaque_part=True),
    Real(
        "openpbr/open_pbr_potassium.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_rubidium.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_sand.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_silicon.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_skin_i.mtlx",
        refused="subsurface scattering is not read",
        opaque_part=True,
    ),
    Real(
        "openpbr/open_pbr_skin_iii.mtlx",
        refused="subsurface scattering is not read",
        opaque_part=True,
    ),
    Real(
        "openpbr/open_pbr_skin_v.mtlx",
        refused="subsurface scattering is not read",
        opaque_part=True,
    ),
    Real(
        "openpbr/open_pbr_snow.mtlx", refused="subsurface scattering is not read", opaque_part=True
    ),
    Real(
        "openpbr/open_pbr_sodium.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_tire.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_toner_black.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "openpbr/open_pbr_vanadium.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real("openpbr/open_pbr_water.mtlx", refused="transmission is not read", opaque_part=True),
    Real(
        "openpbr/open_pbr_zinc.mtlx",
        checked="numbers by a second reading with MaterialX's matrices",
        test=_MATERIALX,
    ),
    Real(
        "speos/R_test.anisotropicbsdf",
        checked="doubles found in the packed file, and the total in its header",
        test=_TABLES,
    ),
    Real(
        "speos/aniso_bsdf.anisotropicbsdf",
        checked="samples of each table by the text alone",
        test=_TABLES,
    ),
    Real(
        "speos/test_13_brdf_one_wavelength_speos.brdf",
        checked="samples by another integral, and the Zemax file of the same measurement",
        test=_TABLES,
    ),
    Real(
        "speos/test_13_planesymmetric_brdf_speos_reference.anisotropicbsdf",
        checked="the Zemax file that it was converted from",
        test=_TABLES,
    ),
    Real(
        "zemax/AnoBlackEC1onAlum.bsdf",
        checked="samples by geometry of the test's own, and totals by another integral",
        test=_TABLES,
    ),
    Real(
        "zemax/AnoBlackNiTEonINVAR.bsdf",
        checked="samples by geometry of the test's own, and totals by another integral",
        test=_TABLES,
    ),
    Real(
        "zemax/IMX455.bsdf",
        checked="samples by geometry of the test's own, and totals by another integral",
        test=_TABLES,
    ),
    Real(
        "zemax/ValidationTest_of_BRDF_via_MagicBlack.bsdf",
        checked="samples by geometry of the test's own, and totals by another integral",
        test=_TABLES,
    ),
    Real(
        "zemax/test_13_brdf_one_wavelength_BRDF_zemax_reference.bsdf",
        checked="samples by geometry of the test's own, and totals by another integral",
        test=_TABLES,
    ),
    Real(
        "zemax/test_13_planesymmetric_brdf_zemax.bsdf",
        checked="samples by geometry of the test's own, and totals by another integral",
        test=_TABLES,
    ),
    Real("zemax/test_13_planesymmetric_btdf_zemax.bsdf", refused="only reflection (BRDF) is read"),
)
