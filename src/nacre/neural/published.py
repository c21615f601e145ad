"""Networks as the authors of the NBRDF paper publish them: Keras `.h5`, and sets of `.npy`.

Layers map (h_x, 0, h_z, d_x, d_y, d_z), d from the light direction, to log(f_r + 1); kernels are
(inputs, outputs).
"""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.files import Format, FormatError, PathLike, atomic_path, read_bytes
from nacre.neural.nbrdf import Layer, NeuralBrdf
from nacre.npy import MAGIC, parse_npy
from nacre.sampling import fit_lobes

_LIMIT = 1 << 26
_NPY_NAME = re.compile(r"(?P<stem>.+)_(?:fc|b)\d+")


def load_h5(path: PathLike) -> NeuralBrdf:
    """Read the weights that Keras saved of a sequential network.

    Raises
    ------
    FormatError
        If the file is not such a network.
    """
    import h5py

    data = read_bytes(path, _LIMIT)
    try:
        with h5py.File(io.BytesIO(data), "r") as file:
            layers: list[Layer] = []
            for name in file.attrs["layer_names"]:
                group = file[_text(name)]
                parts = [_dataset(group[_text(w)], path) for w in group.attrs["weight_names"]]
                if parts:
                    layers.append(Layer(*parts))
        return _network(layers, Path(path).stem)
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(f"{path}: is not an NBRDF network: {error}") from error
    except Exception as error:  # HDF5 meets damage in many ways
        reason = str(error).partition("\n")[0]
        raise FormatError(f"{path}: is not a whole Keras weight file: {reason}") from error


def save_h5(network: NeuralBrdf, path: PathLike) -> None:
    """Write an isotropic network as Keras weights that the authors' tools load.

    Raises
    ------
    FormatError
        If `network` is not an isotropic neural material or the path cannot be written.
    """
    import h5py

    if not (isinstance(network, NeuralBrdf) and network.isotropic):
        raise FormatError(f"{path}: holds isotropic neural materials only; fit the material first")
    names = [f"dense_{index}" for index in range(1, len(network.layers) + 1)]
    content = io.BytesIO()  # HDF5 does not survive a full disk
    with h5py.File(content, "w") as file:
        file.attrs["layer_names"] = [name.encode() for name in [*names, "lambda_1"]]
        file.attrs["backend"] = b"tensorflow"
        file.attrs["keras_version"] = b"2.2.4"
        for name, layer in zip(names, network.layers, strict=True):
            parts = {f"{name}/kernel:0": layer.weights, f"{name}/bias:0": layer.biases}
            group = file.create_group(name)
            group.attrs["weight_names"] = [part.encode() for part in parts]
            for part, values in parts.items():
                group.create_dataset(part, data=values)
        file.create_group("lambda_1").attrs["weight_names"] = np.zeros(0)
    with atomic_path(path) as temporary:
        temporary.write_bytes(content.getvalue())


def load_npy(path: PathLike) -> NeuralBrdf:
    """Read a set `X_fc1.npy, X_b1.npy, X_fc2.npy, ...`; `path` names any one of them.

    Raises
    ------
    FormatError
        If a file of the set is missing or they are not a network.
    """
    path = Path(path)
    match = _NPY_NAME.fullmatch(path.stem)
    if match is None:
        raise FormatError(f"{path}: expected a name like material_fc1.npy or material_b1.npy")
    stem = match["stem"]
    layers: list[Layer] = []
    try:
        while (kernel := path.with_name(f"{stem}_fc{len(layers) + 1}.npy")).exists():
            biases = path.with_name(f"{stem}_b{len(layers) + 1}.npy")
            layers.append(Layer(_read_npy(kernel), _read_npy(biases)))
        return _network(layers, stem)
    except FormatError:
        raise
    except (ValueError, IndexError) as error:
        raise FormatError(f"{path}: is not an NBRDF network: {error}") from error


def _text(name: Any) -> str:
    return name.decode() if isinstance(name, bytes) else str(name)


def _dataset(dataset: Any, path: PathLike) -> npt.NDArray[np.float32]:
    # A dataset may claim any shape: allocate what the file really holds, or little.
    if dataset.nbytes > _LIMIT:
        raise FormatError(f"{path}: dataset {dataset.name} is larger than any network")
    if dataset.chunks is None and dataset.nbytes > dataset.id.get_storage_size():
        raise FormatError(f"{path}: dataset {dataset.name} holds less than its shape says")
    return np.asarray(dataset[()], np.float32)


def _read_npy(path: Path) -> npt.NDArray[np.float32]:
    return np.ascontiguousarray(parse_npy(read_bytes(path, _LIMIT), str(path)), np.float32)


def _network(layers: list[Layer], name: str) -> NeuralBrdf:
    if not all(np.isfinite(part).all() for y in layers for part in (y.weights, y.biases)):
        raise ValueError("weights are not finite")
    network = NeuralBrdf(layers, name=name)
    network.sampler = fit_lobes(network)
    return network


FORMATS = (
    Format(
        "NBRDF network (Keras)",
        (".h5", ".hdf5"),
        lambda head: head.startswith(b"\x89HDF\r\n\x1a\n"),
        load_h5,
        save_h5,
        isotropic=True,
        holds="neural",
    ),
    Format(
        "NBRDF network (NumPy)",
        (".npy",),
        lambda head: head.startswith(MAGIC),
        load_npy,
    ),
)
