"""Files of the latent space: a basis as `.safetensors`, a code as `.json`."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from nacre.errors import FormatError, reason
from nacre.io.files import PathLike, check_json, first_bytes, missing, read_bytes, write_encoded
from nacre.io.tensors import format_errors, from_file, to_bytes
from nacre.latent.basis import CodedBrdf, LatentBasis
from nacre.registry import Registry

if TYPE_CHECKING:
    from nacre.latent.hypernetwork import Hypernetwork
    from nacre.latent.neural_basis import NeuralBasis

VERSION = 1

BASES: Registry[type[LatentBasis]] = Registry(
    "nacre.bases",
    "latent basis",
    {
        "pca": "nacre.latent.pca:PcaBasis",
        "neural": "nacre.latent.neural_basis:NeuralBasis",
        "hypernetwork": "nacre.latent.hypernetwork:Hypernetwork",
        "autoencoder": "nacre.latent.autoencoder:Autoencoder",
    },
)
"""The kinds of bases by name, from nacre and from installed packages."""

PRETRAINED = "neural", "hypernetwork"
"""Names of the included bases."""

KEY = "nacre basis"
_IN_FILES = {"pca": "log-relative PCA"}  # kinds whose files have another name for them
_FIELDS = "code of", "version", "name", "basis", "values"  # of a code
_BASIS_LIMIT, _CODE_LIMIT = 1 << 30, 1 << 20


def save_basis(basis: LatentBasis, path: PathLike) -> None:
    """Write a basis; the same basis gives the same bytes. Raises FormatError if the path cannot be
    written.
    """
    write_encoded(path, _encode, basis)


def _encode(basis: LatentBasis) -> bytes:
    own, tensors = basis.pack()
    model = f"{_in_files(basis)} basis"
    header = {"version": VERSION, "model": model, **own, "metadata": basis.metadata}
    return to_bytes(KEY, header, tensors, _BASIS_LIMIT)


def load_basis(path: PathLike) -> LatentBasis:
    """Read a basis. Raises FormatError if the file is not a whole basis of a known version."""
    header, tensors = from_file(path, KEY, _BASIS_LIMIT, "a basis")
    with format_errors(path):
        model = str(header["model"]).removesuffix(" basis")
        kind = next((kind for kind, name in _IN_FILES.items() if name == model), model)
        if kind not in BASES or model == header["model"]:
            raise FormatError(f"{path}: holds model {header['model']!r}, expected a basis")
        if header["version"] != VERSION:
            raise FormatError(f"{path}: version {header['version']!r} is not {VERSION}")
        if not isinstance(header["metadata"], dict):
            raise FormatError(f"{path}: metadata is not an object")
        check_json(header)
        return BASES[kind].unpack(header, tensors)


def save_code(material: CodedBrdf, path: PathLike) -> None:
    """Write the code of a material, with the fingerprint of the basis it belongs to.

    Raises FormatError if the path cannot be written.
    """
    content = {
        "code of": f"{_in_files(material.basis)} code",
        "version": VERSION,
        "name": material.name,
        "basis": material.basis.fingerprint(),
        "values": [float(v) for v in material.code],
    }
    write_encoded(path, str.encode, json.dumps(content, indent=1) + "\n")


def load_code(path: PathLike, basis: LatentBasis) -> CodedBrdf:
    """Read a code and return the material it stands for; `basis` is the one it was made with.

    Raises FormatError if the file is not a whole code, or belongs to another basis.
    """
    try:
        content = json.loads(read_bytes(path, _CODE_LIMIT).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is not a whole code: {reason(error)}") from error
    missing = [name for name in _FIELDS if name not in content] if isinstance(content, dict) else []
    if not isinstance(content, dict) or missing:
        raise FormatError(f"{path}: is not a whole code: {', '.join(missing) or 'no object'}")
    kind, version, name, fingerprint, values = (content[field] for field in _FIELDS)
    expected = f"{_in_files(basis)} code"
    if kind != expected or version != VERSION:
        raise FormatError(f"{path}: is not a {expected} of version {VERSION}")
    if fingerprint != basis.fingerprint():
        raise FormatError(f"{path}: basis: the code was made with another one")
    if not isinstance(name, str):
        raise FormatError(f"{path}: name is not a text")
    with format_errors(path):
        check_json(name)
    if not isinstance(values, list) or any(type(v) not in (int, float) for v in values):
        raise FormatError(f"{path}: values are not a list of numbers")
    try:
        material = basis.decode([float(v) for v in values], name)
    except (ValueError, OverflowError) as error:
        raise FormatError(f"{path}: values: {reason(error)}") from error
    return material.replaced(source={"file": Path(path).name})


def is_code(path: PathLike) -> bool:
    """Whether a file looks like a code; one that cannot be read does not."""
    return Path(path).suffix.lower() == ".json" and b'"code of"' in first_bytes(path)


def _in_files(basis: LatentBasis) -> str:
    return _IN_FILES.get(basis.kind, basis.kind)


@cache
def pretrained_hypernetwork() -> Hypernetwork:
    """Codes of 32 values for networks of 675 weights, trained on the published NBRDF networks.

    `python -m lab.studies.ablations.shipped_codes` made it, and tells on which of them.
    """
    from nacre.latent.hypernetwork import Hypernetwork

    basis = load_basis(Path(__file__).with_name("published.safetensors"))
    assert isinstance(basis, Hypernetwork)
    return basis


def pretrained_basis() -> NeuralBasis:
    """The neural basis that the codes of :func:`pretrained_hypernetwork` are from."""
    return pretrained_hypernetwork().basis


def find_basis(name: PathLike) -> LatentBasis:
    """The included basis of a name, or that in a file.

    Raises FormatError if the name is not in :data:`PRETRAINED` and the file is not a whole basis.
    """
    if name == "neural":
        return pretrained_basis()
    if name == "hypernetwork":
        return pretrained_hypernetwork()
    if not Path(name).exists():
        raise missing(name, PRETRAINED)
    return load_basis(name)
