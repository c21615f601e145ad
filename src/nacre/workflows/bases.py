"""Training of a latent basis from files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from nacre.errors import FormatError, NacreError
from nacre.formats import load_brdf
from nacre.io.files import PathLike
from nacre.latent.basis import LatentBasis
from nacre.latent.file import BASES, save_basis
from nacre.runtime.progress import Progress
from nacre.runtime.store import Store
from nacre.workflows.sources import find_sources


def train_basis(
    inputs: Sequence[PathLike],
    output: PathLike,
    kind: str = "pca",
    options: Mapping[str, Any] | None = None,
    *,
    progress: Progress | None = None,
    left_out: Callable[[Path], None] = lambda path: None,
) -> LatentBasis:
    """Train a latent basis on isotropic materials and write it; its metadata name the materials.

    A stopped training leaves its state beside the output, and the same call resumes it.

    Parameters
    ----------
    inputs
        Files of materials, and folders with measured materials.
    output
        Basis to write, `.safetensors`.
    kind
        One of :data:`nacre.latent.BASES`.
    options
        Settings that differ from the recommended ones, by the fields of the kind's recipe, such as
        `code_dim`.
    left_out
        Called with every file in a folder that has the ending of a measurement but is not one.

    Raises
    ------
    FormatError
        If an input does not exist or cannot be read, a material is anisotropic, or the output is
        not a `.safetensors` file or cannot be written.
    NacreError
        If the kind is unknown, an option is not for it, there are fewer than two materials, or
        training fails.
    MissingExtraError
        If PyTorch is not installed and the kind needs it.
    """
    output = Path(output)
    if output.suffix.lower() != ".safetensors":
        raise FormatError(f"{output}: a basis is a .safetensors file")
    basis_type = BASES.find(kind)
    recipe = basis_type.recipe(options or {})
    paths = [source.path for source in find_sources(inputs, output.parent / output.stem, left_out)]
    if len(paths) < 2:
        named = ", ".join(map(str, inputs))
        found = f"only {paths[0].name}" if paths else "none"
        raise NacreError(f"{named}: a basis needs at least two materials, found {found}")
    checkpoint = output.with_name(f"{output.name}.state")
    basis = basis_type.train(
        [partial(load_brdf, path) for path in paths],
        recipe,
        checkpoint=checkpoint,
        progress=progress,
    )
    save_basis(basis, output)
    Store(checkpoint).remove()
    return basis
