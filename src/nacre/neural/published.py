"""Networks as the authors of the NBRDF paper publish them: Keras `.h5`, and sets of `.npy`.

Layers map (h_x, 0, h_z, d_x, d_y, d_z), d from the light direction, to log(f_r + 1); kernels are
(inputs, outputs).
"""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.errors import CUT_SHORT, FormatError, reason
from nacre.io.files import PathLike, read_bytes, write_encoded
from nacre.io.format import Format
from nacre.io.npy import MAGIC, parse_npy
from nacre.neural.hdf5_strings import count_strings
from nacre.neural.inputs import PAPER
from nacre.neural.nbrdf import NeuralBrdf, check_weights
from nacre.numerics.mlp import RELU, Layer
from nacre.sampling import fit_lobes

_LIMIT = 1 << 26
KERAS_VERSION = "2.2.4"  # that of the published files
_LAYERS, _WEIGHTS = "layer_names", "weight_names"  # attributes that list names
_NPY_NAME = re.compile(r"(?P<stem>.+)_(?:fc|b)\d+")
PAPER_ONLY = (
    "holds networks of the paper's inputs and activation only; fit with --inputs paper, in Python "
    "with nacre.Recipe(inputs='paper')"
)
"""What to say where another network should be written as `.h5`."""


def load_h5(path: PathLike) -> NeuralBrdf:
    """Read a sequential network's weights from Keras; FormatError if the file holds none."""
    import h5py

    data = read_bytes(path, _LIMIT)
    try:
        sound = {key for key in (_LAYERS, _WEIGHTS) if count_strings(data, key)}
        with h5py.File(io.BytesIO(data), "r") as file:
            layers: list[Layer] = []
            for name in _names(file, _LAYERS, len(data), sound):
                group = file[name]
                weights = _names(group, _WEIGHTS, len(data), sound)
                parts = [_dataset(group[w], path, len(data)) for w in weights]
                if parts:
                    layers.append(Layer(*parts))
        return _network(layers, Path(path).stem)
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(f"{path}: is not an NBRDF network: {reason(error)}") from error
    except Exception as error:  # HDF5 meets damage in many ways
        problem = CUT_SHORT if isinstance(error, OSError) else reason(error)
        raise FormatError(f"{path}: is not a whole Keras weight file: {problem}") from error


def save_h5(network: NeuralBrdf, path: PathLike) -> None:
    """Write an isotropic network as Keras weights that the authors' tools load.

    Raises FormatError if `network` is not an isotropic neural material, or the path cannot be
    written.
    """
    if not (isinstance(network, NeuralBrdf) and network.isotropic):
        raise FormatError(f"{path}: holds isotropic neural materials only; fit the material first")
    if network.inputs != PAPER or network.activation != RELU:
        raise FormatError(f"{path}: {PAPER_ONLY}")
    write_encoded(path, keras_bytes, network.layers)


def keras_bytes(layers: Sequence[Layer], description: str = "") -> bytes:
    """Layers as Keras saves the weights of a sequential network, with a description."""
    import h5py

    names = [f"dense_{index}" for index in range(1, len(layers) + 1)]
    content = io.BytesIO()  # HDF5 does not survive a full disk
    with h5py.File(content, "w") as file:
        file.attrs[_LAYERS] = np.array([*names, "lambda_1"], "S")  # Keras 2 decodes their bytes
        file.attrs["backend"] = b"tensorflow"
        file.attrs["keras_version"] = KERAS_VERSION.encode()
        if description:
            file.attrs["description"] = description.encode()
        for name, layer in zip(names, layers, strict=True):
            parts = {f"{name}/kernel:0": layer.weights, f"{name}/bias:0": layer.biases}
            group = file.create_group(name)
            group.attrs[_WEIGHTS] = np.array([*parts], "S")
            for part, values in parts.items():
                group.create_dataset(part, data=values)
        file.create_group("lambda_1").attrs[_WEIGHTS] = np.zeros(0)
    return content.getvalue()


def load_npy(path: PathLike) -> NeuralBrdf:
    """Read a set `X_fc1.npy, X_b1.npy, X_fc2.npy, ...`; `path` names any one of them.

    Raises FormatError if a file of the set is missing or they are not a network.
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
        raise FormatError(f"{path}: is not an NBRDF network: {reason(error)}") from error


def _names(group: Any, key: str, limit: int, sound: set[str]) -> list[str]:
    """Names that an attribute lists, which must fit into `limit` bytes.

    Those of variable length are read only from attributes that were found to be sound.
    """
    import h5py

    attribute = group.attrs.get_id(key)
    if 0 in attribute.shape:
        return []
    strings = h5py.check_string_dtype(attribute.dtype)
    unsound = strings is None or (strings.length is None and key not in sound)
    if unsound or len(attribute.shape) != 1:
        raise ValueError(f"attribute '{key}' is no list of strings")
    if attribute.shape[0] * attribute.dtype.itemsize > limit:
        raise ValueError(f"attribute '{key}' holds less than its shape says")
    return [n.decode() if isinstance(n, bytes) else str(n) for n in group.attrs[key]]


def _dataset(dataset: Any, path: PathLike, limit: int) -> Weights:
    where = f"{path}: dataset {dataset.name[:80]}"
    # Only numbers that lie in this file as they are: others unpack to any size or are elsewhere.
    if dataset.chunks is not None or dataset.is_virtual or dataset.external:
        raise FormatError(f"{where}: is not stored whole and plain; save the weights with Keras")
    if dataset.dtype.kind != "f":
        raise FormatError(f"{where}: holds {dataset.dtype}, expected floating-point numbers")
    if dataset.nbytes > min(limit, dataset.id.get_storage_size()):
        raise FormatError(f"{where}: holds less than its shape says")
    return _float32(dataset[()])


def _read_npy(path: Path) -> Weights:
    return _float32(parse_npy(read_bytes(path, _LIMIT), str(path)))


def _float32(values: npt.ArrayLike) -> Weights:
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused later
        return np.ascontiguousarray(values, np.float32)


def _network(layers: list[Layer], name: str) -> NeuralBrdf:
    check_weights(layers)
    network = NeuralBrdf(layers, name=name)
    return network.replaced(sampler=fit_lobes(network))


KERAS = Format(
    "NBRDF network (Keras)",
    (".h5", ".hdf5"),
    lambda head: head.startswith(b"\x89HDF\r\n\x1a\n"),
    load_h5,
    save_h5,
    isotropic=True,
    holds="neural",
    measured=False,
)
NUMPY = Format(
    "NBRDF network (NumPy)",
    (".npy",),
    lambda head: head.startswith(MAGIC),
    load_npy,
    measured=False,
)
