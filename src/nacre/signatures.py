"""Where the built-in formats are, and what their files begin with: one entry for every format."""

from nacre.io.format import Signature

SIGNATURES: dict[str, Signature] = {
    "nacre neural material": Signature(
        "nacre.neural.file:FORMAT", (".safetensors",),
        rb'\A.{4}\0{4}\{(?!"__metadata__":\{"nacre [ a-z]+":)', measured=False,
    ),
    "analytic": Signature(
        "nacre.analytic.file:FORMAT", (".json",), rb'\A\s*\{.*"model"', measured=False
    ),
    "table of fits": Signature(
        "nacre.analytic.tables:FORMAT", (".fit",), rb"BSDF fits|Aggregate\(",
        measured=False, writes=False,
    ),
    "glTF": Signature(
        "nacre.standard.files.glb:FORMAT", (".glb", ".gltf"),
        rb'\AglTF|\A\s*\{.*"(asset|materials|extensionsUsed|accessors|scenes)"', measured=False,
    ),
    "UBO2014": Signature(
        "nacre.measured.textures.ubo2014:FORMAT", (".btf",), rb"\A!DFMF08FCR", "btf"
    ),
    "NumPy archive of a BTF": Signature(
        "nacre.measured.textures.archive:FORMAT", (".npz",), rb"\APK\x03\x04", "btf"
    ),
    "nacre encoded texture": Signature(
        "nacre.textures.latent_file:FORMAT", (".safetensors",),
        rb'\A.{4}\0{4}\{(?!"__metadata__":\{"nacre(?! latent map")[ a-z]*":)', "btf",
    ),
    "UTIA BTF folder": Signature(
        "nacre.measured.textures.utia_folder:FORMAT", (), None, "btf", writes=False, folders=True
    ),
    "photographs": Signature(
        "nacre.measured.textures.photographs:FORMAT", (".csv",),
        rb'(?i)(\A|[\n\r,;\t])[ "]*file[ "]*([,;\t\n\r]|\Z)', "btf",
        writes=False, folders=True,
    ),
    "polarized BRDF": Signature(
        "nacre.measured.polarized:FORMAT", (".pbsdf",), rb"\Atensor_file\0.*phi_d", writes=False
    ),
    "RGL": Signature("nacre.measured.rgl:FORMAT", (".bsdf",), rb"\Atensor_file\0"),
    "MERL": Signature("nacre.measured.merl:FORMAT", (".binary",), rb"\A(..\0\0){3}"),
    "MERL array (.npz)": Signature(
        "nacre.measured.merl_array:NPZ", (".npz",), rb"\APK\x03\x04.{26}.*\.npy"
    ),
    "MERL array (.npy)": Signature(
        "nacre.measured.merl_array:NPY", (".npy",), rb"\A\x93NUMPY", writes=False
    ),
    "Zemax BSDF": Signature(
        "nacre.measured.zemax:FORMAT", (".zemax.bsdf", ".bsdf"), rb"(?i)\A(?=.*source).*symmetry"
    ),
    "Speos BSDF": Signature(
        "nacre.measured.speos:FORMAT", (".brdf",), rb"\AOPTIS - brdf surface file"
    ),
    "universal BRDF file (BiRD)": Signature(
        "nacre.measured.bird:FORMAT", (".bird.brdf", ".brdf"), rb"\A\s*\{.*brdf_json_schema"
    ),
    "Speos anisotropic BSDF": Signature(
        "nacre.measured.speos_anisotropic:FORMAT", (".anisotropicbsdf",),
        rb"(?i)\AOPTIS - anisotropic bsdf surface file",
    ),
    "FRED scatter": Signature(
        "nacre.measured.fred:FORMAT", (".fred.txt", ".txt"), rb"(?i)\A\s*type bsdf_data"
    ),
    "TracePro surface property": Signature(
        "nacre.measured.tracepro:FORMAT", (".txt",),
        rb"(?i)\A\s*tracepro surface property data", writes=False,
    ),
    "pab-opto scan": Signature(
        "nacre.measured.pab:FORMAT", (".txt",), rb"(?i)#\s*format:\s*theta\s+phi\s",
        writes=False, folders=True,
    ),
    "LightTools BSDF": Signature(
        "nacre.measured.lighttools:FORMAT", (".bsdf",), rb"(?i)symmetry.*scatterradial",
        writes=False,
    ),
    "SSDD": Signature("nacre.measured.ssdd:FORMAT", (".ssdd",), rb"\A\s*VERSION .*DATA_TYPE"),
    "OpenMATERIAL 3D": Signature("nacre.measured.openmaterial:FORMAT", (".xompt",), None),
    "OpenMATERIAL 3D material": Signature(
        "nacre.measured.openmaterial:MATERIAL", (".xomp",), None, writes=False
    ),
    "MaterialX": Signature(
        "nacre.standard.files.materialx:FORMAT", (".mtlx",), rb"<materialx", measured=False,
        by_ending=True,
    ),
    "USD (text)": Signature(
        "nacre.standard.files.usda:FORMAT", (".usda", ".usd"), rb"\A(#usda |PXR-USDC)",
        measured=False,
    ),
    "comma-separated samples": Signature(
        "nacre.measured.comma_separated:FORMAT", (".csv",),
        rb"(?i)\A(?!tensor_file).*theta_|\A\s*astm",
    ),
    "table of a goniometer": Signature(
        "nacre.measured.goniometer.reader:FORMAT", (".txt", ".csv", ".tsv", ".dat", ".xlsx"),
        rb"\APK\x03\x04.*(\[Content_Types\]\.xml|docProps/|xl/)", writes=False, by_ending=True,
    ),
    "ASTM E1392 samples": Signature(
        "nacre.measured.comma_separated:ASTM", (".astm",), None, writes=False
    ),
    "MDL": Signature("nacre.measured.mbsdf:FORMAT", (".mbsdf",), rb"\ANVIDIA ARC MBSDF V1\n"),
    "Cornell scan": Signature(
        "nacre.measured.cornell:FORMAT", (".brdf",), rb"\A#.*(Cornell|wls)", writes=False,
    ),
    "Radiance BSDF": Signature("nacre.measured.radiance:FORMAT", (".xml",), rb"<WindowElement"),
    "UTIA": Signature("nacre.measured.utia:FORMAT", (".bin",), None),
    "UTIA image (.exr)": Signature(
        "nacre.measured.utia_image:EXR", (".exr",), rb"\A\x76\x2f\x31\x01"
    ),
    "UTIA image (.png)": Signature(
        "nacre.measured.utia_image:PNG", (".png",), rb"\A\x89PNG\r\n\x1a\n", writes=False
    ),
    "NBRDF network (Keras)": Signature(
        "nacre.neural.published:KERAS", (".h5", ".hdf5"), rb"\A\x89HDF\r\n\x1a\n", measured=False
    ),
    "NBRDF network (NumPy)": Signature(
        "nacre.neural.published:NUMPY", (".npy",), rb"\A\x93NUMPY", measured=False, writes=False
    ),
}  # fmt: skip
