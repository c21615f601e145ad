"""Files that nacre 0.1.0 wrote: they load, and evaluate to the same bits.

They lie in `fixtures/written`, whose README says how they were made. What they should
evaluate to lies beside them, with a note of the machine: the last bits depend on the vector
instructions that NumPy, PyTorch, Numba and BLAS choose. On other machines, or with other versions
of these libraries, numbers are compared to a part in 100,000, or in 100,000 of the largest of an
array.
"""

from __future__ import annotations

import gzip
import json
import platform
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

import llvmlite.binding
import numba
import numpy as np
import numpy.typing as npt
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import nacre

# What is reached for below the public names, all of it here.
from nacre.formats import load_brdf
from nacre.formats import load_btf as load_texture
from nacre.latent import find_basis
from nacre.latent.file import load_code
from nacre.measured.textures.direction_list import named_directions
from nacre.runtime.store import Store
from nacre.textures.codecs import load_codec
from nacre.textures.embedding import load_embedding_map
from nacre.workflows import Manifest, NetworkFitting, fit_library
from tests.cli.support import run

Results: TypeAlias = dict[str, npt.NDArray[Any]]

WRITTEN = Path(__file__).with_name("fixtures") / "written"
MACHINE = WRITTEN / "machine.json"
FOLDERS = "analytic", "neural", "tables", "latent", "textures"
SAMPLED = (
    "neural/*.safetensors", "analytic/ggx*", "analytic/lambert*", "tables/rgl*",
    "latent/*neural.json", "textures/material-*",
)  # fmt: skip
"""Files that say how to draw samples; for others, lobes are fitted."""
FITTING = NetworkFitting(nacre.Recipe(hidden=(4, 4), epochs=1, samples=2000))
"""Of the library."""


def directions(count: int, seed: int) -> npt.NDArray[np.float64]:
    """Unit vectors above the horizon, some of them close to it."""
    z, turn = np.random.default_rng(seed).random((2, count))
    z[::8] *= 0.01
    across = np.sqrt(1.0 - z * z)
    turn *= 2.0 * np.pi
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)


WI, WO = directions(48, 1), directions(48, 2)
WI[1], WO[1] = (0.6, 0.0, 0.8), (-0.6, 0.0, 0.8)
LIGHT, VIEW = WI.astype(np.float32), WO.astype(np.float32)
UNIFORM = np.random.default_rng(3).random((48, 3)).astype(np.float32)


def of_material(name: str) -> Results:
    """Values in single and double precision, and samples where the file says how to draw them."""
    return of_brdf(load_brdf(WRITTEN / name), any(fnmatch(name, part) for part in SAMPLED))


def of_brdf(brdf: nacre.Brdf, sampled: bool) -> Results:
    """See :func:`of_material`."""
    found = {"f_r": brdf.eval(LIGHT, VIEW), "f_r double": brdf.eval(WI[:12], WO[:12])}
    if brdf.wavelengths is not None:
        found |= {"bands": brdf.eval_spectral(LIGHT[:12], VIEW[:12])}
    if sampled:
        drawn, density = brdf.sample(VIEW, UNIFORM)
        found |= {"drawn": drawn, "density": density, "pdf": brdf.pdf(LIGHT, VIEW)}
    return found


def of_packed(name: str) -> Results:
    """Of a table that takes megabytes when it is not packed."""
    packed = WRITTEN / name
    with TemporaryDirectory() as folder:
        path = Path(folder) / packed.stem
        path.write_bytes(gzip.decompress(packed.read_bytes()))
        return of_brdf(nacre.load(path), False)


def of_basis(name: str) -> Results:
    """What a basis makes of a code."""
    basis = find_basis(str(WRITTEN / name))
    return of_brdf(basis.decode(np.linspace(-0.7, 0.6, basis.code_dim)), name.endswith("-neural"))


def of_code(name: str) -> Results:
    """A code, and its material."""
    path = WRITTEN / name
    kind = path.stem.removeprefix("code-")
    own = path.with_name(f"basis-{kind}.safetensors")
    basis = find_basis(str(own) if own.exists() else kind.removeprefix("shipped-"))
    material: Any = load_code(path, basis)
    sampled = any(fnmatch(name, part) for part in SAMPLED)
    return {"code": material.code} | of_brdf(material, sampled)


def of_texture(name: str) -> Results:
    """Texels and pictures; of an encoded texture, codes and texels at other directions too."""
    texture: Any = load_texture(WRITTEN / name)
    every = slice(None)
    found = {"wi": texture.wi, "wo": texture.wo, "texels": texture.texels(every)}
    if texture.latent is None:
        return found | {"images": texture.images(slice(0, 2))}
    wi, wo = decodable(texture.latent.codec, texture.wi, texture.wo)
    other = texture.at_directions(wi[:9], wo[:9]).texels(every)
    return found | {"codes": texture.latent.codes, "other": other}


def decodable(codec: Any, *own: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], ...]:
    """Directions that a codec decodes at: any, or those of its own."""
    try:
        codec.decoder(LIGHT, VIEW)
    except nacre.NacreError:
        return own
    return LIGHT, VIEW


def of_texel(name: str) -> Results:
    """An encoded texture of one texel is a material as well."""
    return of_texture(name) | of_material(name)


def of_model(name: str) -> Results:
    """Codes of the texels of the capture, and what fixed codes decode to."""
    codec, texture = load_codec(WRITTEN / name), load_texture(WRITTEN / "textures" / "capture.npz")
    texels = texture.texels(slice(None))
    codes = np.random.default_rng(4).normal(size=(3, codec.code_dim)).astype(np.float32)
    encode = codec.encoder(texture.wi, texture.wo)
    decode = codec.decoder(*decodable(codec, texture.wi, texture.wo))
    return {"codes": encode(texels), "decoded": decode(codes)}


def of_list(name: str) -> Results:
    """Directions."""
    wi, wo = named_directions(str(WRITTEN / name))
    return {"wi": wi, "wo": wo}


def of_places(name: str) -> Results:
    """A map of texels."""
    places = load_embedding_map(WRITTEN / name)
    arrays = ("texture", "xy", "codes", "places", "colors")
    return {array: getattr(places, array) for array in arrays}


READERS: dict[str, Callable[[str], Results]] = {
    "tables/*.gz": of_packed,
    "latent/basis-*": of_basis,
    "latent/code-*": of_code,
    "textures/model-*": of_model,
    "textures/material-*": of_texel,
    "textures/list-*": of_list,
    "textures/places.*": of_places,
    "textures/*": of_texture,
    "*": of_material,
}
"""What evaluates a file, by the first pattern that its name is of."""


def evaluated(name: str) -> Results:
    """Numbers that a file stands for, by name."""
    with one_thread():
        return next(read for part, read in READERS.items() if fnmatch(name, part))(name)


@contextmanager
def one_thread() -> Iterator[None]:
    """A block whose sums do not depend on the number of cores."""
    with threadpool_limits(1):
        yield


def names() -> list[str]:
    """Every file, from the folder of all."""
    paths = (path for folder in FOLDERS for path in (WRITTEN / folder).iterdir())
    return sorted(path.relative_to(WRITTEN).as_posix() for path in paths)


def machine() -> dict[str, Any]:
    """What the last bits of results depend on."""
    found = np.show_config(mode="dicts")["SIMD Extensions"]
    libraries = {
        "numpy": np.__version__,
        "numba": f"{numba.__version__} {llvmlite.binding.get_host_cpu_name()}",
    }
    try:
        import torch

        libraries |= {
            "torch": torch.__version__,
            "dispatch": torch.backends.cpu.get_cpu_capability(),
        }
    except ImportError:
        pass
    blas = {str(m.get("architecture")) for m in threadpool_info() if m["user_api"] == "blas"}
    return {
        "system": [platform.system(), platform.machine(), *platform.libc_ver()],
        "instructions": sorted([*found.get("baseline", []), *found.get("found", [])]),
        "libraries": libraries,
        "blas": sorted(blas),
    }


@cache
def same_machine() -> bool:
    """Whether results can be compared bit by bit."""
    return bool(json.loads(MACHINE.read_text()) == machine())


def write_expected(folder: str, results: dict[str, Results]) -> None:
    """Keep what files evaluate to; for the script that made them."""
    flat = {f"{name} | {key}": a for name, found in results.items() for key, a in found.items()}
    np.savez_compressed(WRITTEN / f"expected-{folder}.npz", **flat)


@cache
def expected(folder: str) -> dict[str, Results]:
    """What :func:`write_expected` kept."""
    found: dict[str, Results] = {}
    with np.load(WRITTEN / f"expected-{folder}.npz") as arrays:
        for key in arrays.files:
            name, _, part = key.partition(" | ")
            found.setdefault(name, {})[part] = arrays[key]
    return found


COMPILED = {"f_r", "drawn", "density", "pdf"}
"""What 0.1.0 computed by NumPy, and code of other roundings computes now; in single precision."""

REORDERED = {
    "tables/bands.csv": {"f_r double"},
    "tables/scan.csv": {"f_r double"},
    "textures/model-basis.safetensors": {"codes"},
    "textures/model-basis-half.safetensors": {"codes"},
}
"""What is summed in another order than 0.1.0 did, by file: samples of scans have weights now, and
moments of texels are compiled."""


def assert_same(found: Results, kept: Results, name: str) -> None:
    """The same arrays, bit by bit on the same machine where they are computed as they were."""
    other = COMPILED | REORDERED.get(name, set())
    assert found.keys() == kept.keys()
    for key, array in kept.items():
        # Directions drawn from single precision were double ones where numbers of lobes were equal.
        assert found[key].dtype == (np.float32 if key == "drawn" else array.dtype), key
        if same_machine() and key not in other:
            np.testing.assert_array_equal(found[key], array, err_msg=key, strict=True)
        else:
            reordered = same_machine() and key not in COMPILED
            near = 1e-10 if reordered and array.dtype == np.float64 else 1e-5
            atol = near * float(np.abs(array).max(initial=0))
            np.testing.assert_allclose(found[key], array, rtol=near, atol=atol, err_msg=key)


def test_no_file_is_left_out():
    assert {name for folder in FOLDERS for name in expected(folder)} == set(names())


@pytest.mark.parametrize("name", names())
def test_files_evaluate_to_what_they_did(name):
    try:
        found = evaluated(name)
    except nacre.MissingExtraError as error:
        pytest.skip(str(error))
    assert_same(found, expected(name.partition("/")[0])[name], name)


def test_a_written_texture_of_codes_is_of_the_values_in_its_file():
    """Codes are read, not computed: they are the same on every machine."""
    kept = expected("textures")
    for name, results in kept.items():
        if "codes" in results and "other" in results:
            texture: Any = load_texture(WRITTEN / name)
            np.testing.assert_array_equal(texture.latent.codes, results["codes"], strict=True)


def test_a_library_goes_on(tmp_path):
    """Its manifest is read; fits of older code are made again, in place of those that it names."""
    folder = shutil.copytree(WRITTEN / "library", tmp_path / "library")
    records = Manifest(folder / "fits").records()
    assert [record.output for record in records] == [
        f"{name}.safetensors" for name in ("broken", "ggx", "ward")
    ]
    assert {record.nacre for record in records} == {"0.1.0"}
    for record in records[1:]:
        assert nacre.load(folder / "fits" / record.output).source["sha256"] == record.output_sha256
    outcome = fit_library([folder / "measured"], folder / "fits", FITTING)
    assert [record.source for record in outcome.failed] == ["broken.binary"]
    fitted, unchanged = ([r.source for r in part] for part in (outcome.fitted, outcome.unchanged))
    # It does not say by what code they were fitted: see docs/guide/libraries.md.
    assert (unchanged, fitted) == ([], ["ggx.binary", "ward.binary"])
    again = fit_library([folder / "measured"], folder / "fits", FITTING)
    assert [r.source for r in again.unchanged] == fitted


def test_a_folder_of_captures_goes_on(tmp_path):
    """The manifest is of the same settings and surfaces, else the command refuses the folder."""
    folder = shutil.copytree(WRITTEN / "captures", tmp_path / "captures")
    manifest = folder / "capture.json"
    before = manifest.read_bytes()
    for name in json.loads(before)["textures"]:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).touch()  # there already, so not captured
    size = ("--texels", 1, "--paths", 1, "--directions", folder / "dome.csv")
    assert run("btf", "capture", "--all", *size, "-o", folder) == 0
    assert manifest.read_bytes() == before


def test_a_recipe_of_a_surface_is_captured_as_it_was(tmp_path):
    size = ("--texels", 4, "--paths", 4, "--directions", WRITTEN / "captures" / "dome.csv")
    path, recipe = tmp_path / "recipe.npz", WRITTEN / "captures" / "recipe.json"
    assert run("btf", "capture", recipe, *size, "-o", path) == 0
    kept = load_texture(WRITTEN / "captures" / "recipe.npz").texels(slice(None))
    found = load_texture(path).texels(slice(None))
    if same_machine():
        np.testing.assert_array_equal(found, kept, strict=True)
    else:
        np.testing.assert_allclose(found.mean(), kept.mean(), rtol=0.01)


@pytest.mark.parametrize("path", sorted((WRITTEN / "states").iterdir()), ids=lambda p: p.name)
def test_states_of_stopped_work_are_refused_in_a_line_and_stay(path):
    before = path.read_bytes()
    with pytest.raises(nacre.NacreError, match="cannot be read, remove it to start over"):
        Store(path).load()
    assert path.read_bytes() == before
