"""Files of the latent space: a basis as `.safetensors`, a code as `.json`."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from nacre.errors import FormatError, reason
from nacre.io.files import PathLike, atomic_path, first_bytes, read_bytes, write_encoded
from nacre.io.tensors import from_file, to_bytes
from nacre.latent import autoencoder_file, hypernetwork_file, neural_file, pca_file
from nacre.latent.autoencoder import Autoencoder
from nacre.latent.hypernetwork import Hypernetwork
from nacre.latent.neural_basis import NeuralBasis, NeuralBasisBrdf
from nacre.latent.pca import Basis, PcaBrdf
from nacre.latent.weights import CodedNetwork, WeightBasis

VERSION = 1
AnyBasis: TypeAlias = Basis | NeuralBasis | Hypernetwork | Autoencoder
Coded: TypeAlias = PcaBrdf | NeuralBasisBrdf | CodedNetwork

_MODELS: dict[str, tuple[type[AnyBasis], Any]] = {
    "log-relative PCA": (Basis, pca_file),
    "neural": (NeuralBasis, neural_file),
    "autoencoder": (Autoencoder, autoencoder_file),
    "hypernetwork": (Hypernetwork, hypernetwork_file),
}
"""By what files say they are: the class, and the module that packs and unpacks it."""
_KEY = "nacre basis"
_BASIS_LIMIT, _CODE_LIMIT = 1 << 30, 1 << 20


def save_basis(basis: AnyBasis, path: PathLike) -> None:
    """Write a basis; the same basis gives the same bytes.

    Raises
    ------
    FormatError
        If the path cannot be written.
    """
    write_encoded(path, _encode, basis)


def _encode(basis: AnyBasis) -> bytes:
    model = _model(basis)
    own, tensors = _MODELS[model][1].pack(basis)
    header = {"version": VERSION, "model": f"{model} basis", **own, "metadata": basis.metadata}
    return to_bytes(_KEY, header, tensors, _BASIS_LIMIT)


def load_basis(path: PathLike) -> AnyBasis:
    """Read a basis.

    Raises
    ------
    FormatError
        If the file is not a whole basis of a version we know.
    """
    header, tensors = from_file(path, _KEY, _BASIS_LIMIT, "a basis")
    try:
        model = str(header["model"]).removesuffix(" basis")
        if model not in _MODELS or model == header["model"]:
            raise FormatError(f"{path}: holds model {header['model']!r}, expected a basis")
        if header["version"] != VERSION:
            raise FormatError(f"{path}: version {header['version']!r} is not {VERSION}")
        if not isinstance(header["metadata"], dict):
            raise FormatError(f"{path}: metadata is not an object")
        basis: AnyBasis = _MODELS[model][1].unpack(header, tensors)
        return basis
    except FormatError:
        raise
    except KeyError as error:
        raise FormatError(f"{path}: field {reason(error)} is missing; is no basis") from error
    except (TypeError, ValueError, RecursionError, OverflowError) as error:
        raise FormatError(f"{path}: is not a whole basis: {reason(error)}") from error


def save_code(material: Coded, path: PathLike) -> None:
    """Write the code of a material, with a mark of the basis that it belongs to.

    Raises
    ------
    FormatError
        If the path cannot be written.
    """
    content = {
        "code of": f"{_model(material.basis)} code",
        "version": VERSION,
        "name": material.name,
        "basis": fingerprint(material.basis),
        "values": [float(v) for v in material.code],
    }
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def load_code(path: PathLike, basis: AnyBasis) -> Coded:
    """Read a code and give the material that it stands for.

    Parameters
    ----------
    path
        File to read.
    basis
        The one that the code was made with.

    Raises
    ------
    FormatError
        If the file is not a whole code, or belongs to another basis.
    """
    try:
        content = json.loads(read_bytes(path, _CODE_LIMIT).decode("utf-8"))
        kind, version = content["code of"], content["version"]
        name, mark, values = content["name"], content["basis"], content["values"]
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is not a whole code: {reason(error)}") from error
    expected = f"{_model(basis)} code"
    if kind != expected or version != VERSION:
        raise FormatError(f"{path}: is not a {expected} of version {VERSION}")
    if mark != fingerprint(basis):
        raise FormatError(f"{path}: basis: the code was made with another one")
    try:
        material = basis.decode([float(v) for v in values], str(name))
    except (TypeError, ValueError, OverflowError) as error:
        raise FormatError(f"{path}: values: {reason(error)}") from error
    return material.replaced(source={"file": Path(path).name})


def is_code(path: PathLike) -> bool:
    """Whether a file looks like a code; one that cannot be read does not."""
    return Path(path).suffix.lower() == ".json" and b'"code of"' in first_bytes(path)


def fingerprint(basis: AnyBasis | WeightBasis, *, predictors: bool = False) -> str:
    """SHA-256 of what a code means in a basis, and of what is predicted from it if asked for."""
    if isinstance(basis, NeuralBasis) and not predictors:
        basis = replace(basis, predictors={})
    own, tensors = _MODELS[_model(basis)][1].pack(basis)
    digest = hashlib.sha256(json.dumps(own).encode())
    for name in sorted(tensors):
        digest.update(tensors[name].tobytes())
    return digest.hexdigest()


def _model(basis: AnyBasis | WeightBasis) -> str:
    return next(name for name, (kind, _) in _MODELS.items() if isinstance(basis, kind))
