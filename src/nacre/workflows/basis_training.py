"""Latent bases trained from files."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre import latent
from nacre.errors import FormatError, NacreError
from nacre.formats import load_brdf
from nacre.io.files import PathLike
from nacre.latent.file import save_basis
from nacre.measured.merl import Resolution
from nacre.runtime.progress import Progress, silent

if TYPE_CHECKING:
    from nacre.latent.file import AnyBasis

BASES = "pca", "neural", "hypernetwork", "autoencoder"
"""Kinds of bases."""


def train_basis(
    paths: Sequence[PathLike],
    output: PathLike,
    model: str = "pca",
    *,
    code_dim: int = 32,
    resolution: Sequence[int] | None = None,
    separate: bool = False,
    steps: int | None = None,
    seed: int | None = None,
    progress: Progress = silent,
) -> AnyBasis:
    """Train a latent basis on isotropic materials, and write it.

    Trainings of networks keep their state beside the output until they are done, and continue from
    it.

    Parameters
    ----------
    paths
        Files of materials.
    output
        File to write (`.safetensors`).
    model
        One of :data:`BASES`.
    code_dim
        Latent size.
    resolution
        Nodes of the grid of "pca": theta_h, theta_d, phi_d.
    separate
        Take each channel as a material of its own, in place of the six permutations; "pca" only.
    steps, seed
        Of the training of networks.
    progress
        Called with the steps done.

    Raises
    ------
    NacreError
        If a file is absent, a folder or no isotropic material, or there are too few of them.
    """
    output = Path(output)
    for path in map(Path, paths):
        if path.is_dir():
            raise FormatError(f"{path}: is a folder; name the files in it, like {path}/*")
        if not path.exists():
            raise FormatError(f"{path}: does not exist")
    materials = [partial(load_brdf, path) for path in paths]
    chosen = {"steps": steps, "seed": seed}
    settings: dict[str, Any] = {key: value for key, value in chosen.items() if value is not None}
    states = [output.with_name(f"{output.name}.{name}") for name in ("state", "hypernetwork.state")]
    basis: AnyBasis
    if model == "pca":
        try:
            grid = {"resolution": Resolution(*resolution)} if resolution else {}
        except ValueError as error:
            raise NacreError(f"resolution: {error}") from error
        basis = latent.train(materials, code_dim, separate=separate, progress=progress, **grid)
    elif model == "autoencoder":
        from nacre.render.sphere import lit_pixels

        coder = latent.AutoencoderRecipe(values=code_dim, **settings)
        basis = latent.train_autoencoder(
            materials, lit_pixels(), coder, checkpoint=states[0], progress=progress
        )
    else:
        recipe = latent.BasisRecipe(values=code_dim, **settings)
        basis = latent.train_neural(materials, recipe, checkpoint=states[0], progress=progress)
        steps = min(recipe.steps, latent.PredictorRecipe.steps)
        lobes = latent.PredictorRecipe(steps=steps, seed=recipe.seed)
        basis = latent.with_predictors(basis, lobes, progress=progress)
        if model == "hypernetwork":
            basis = latent.train_hypernetwork(
                basis,
                latent.HypernetworkRecipe(**settings),
                checkpoint=states[1],
                progress=progress,
            )
    save_basis(basis, output)
    if model != "pca":
        for state in states:
            state.unlink(missing_ok=True)
    return basis
