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
    """Train a latent basis on isotropic materials and write it.

    Beside the output lies the state of a training that was stopped, from which the same call goes
    on; it is removed when the basis is written.

    Parameters
    ----------
    inputs
        Files of materials, and folders, in which the measured materials are taken.
    output
        Basis to write, `.safetensors`.
    kind
        One of :data:`nacre.latent.BASES`.
    options
        Settings of the training by the names of the fields of the kind's recipe, like `code_dim`;
        the recommended ones where not given.
    progress
        Called as it goes on.
    left_out
        Called with every file in a folder that has an ending of measurements, but is none.

    Returns
    -------
    LatentBasis
        Its metadata name the materials.

    Raises
    ------
    FormatError
        If an input does not exist or cannot be read, a material is anisotropic, or the output is no
        `.safetensors` file or cannot be written.
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
