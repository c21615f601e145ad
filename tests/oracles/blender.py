"""OSL shaders and the Principled node in Cycles, by a Python of its own that has Blender: `bpy`."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.mitsuba.environment import Environment

VARIABLE = "NACRE_BLENDER_PYTHON"
"""Environment variable with the path of a Python that can import `bpy`."""

_SCRIPT = Path(__file__).with_name("cycles_script.py")


def missing() -> str | None:
    """What has to be set before shaders run."""
    path = os.environ.get(VARIABLE)
    if not path:
        return f"Blender's bpy (make parity-blender; {VARIABLE})"
    return None if Path(path).exists() else f"{path} of {VARIABLE}"


def shade(shader: str, a: Weights, b: Weights) -> tuple[Weights, float]:
    """What an OSL shader computes of pairs of vectors.

    Parameters
    ----------
    shader
        In OSL, with the inputs `vector a, vector b`. Colors that are not finite come back as 0.
    a, b
        Float32 of shape (n, 3).

    Returns
    -------
    Its outputs, float32 of shape (outputs, n, 3), and the seconds that rendering the first took

    Raises
    ------
    RuntimeError
        If it does not compile; with the words of the compiler.
    """
    with tempfile.TemporaryDirectory() as folder:
        given = Path(folder, "pairs.npy")
        np.save(given, np.stack([a, b]).astype(np.float32))
        colors, printed = _run(Path(folder), "pairs", shader, given)
    seconds = [line.split()[1] for line in printed.splitlines() if line.startswith("seconds ")]
    return colors, float(seconds[-1])


def sphere(shader: str, size: int, samples: int) -> Weights:
    """A sphere that emits the radiance of the shader `NAME_lit` of an export.

    Linear RGB, float32 of shape (size, size, 3), in the light and view of
    :mod:`nacre.mitsuba.sphere`. RuntimeError as for :func:`shade`.
    """
    with tempfile.TemporaryDirectory() as folder:
        return _run(Path(folder), "sphere", shader, size, samples)[0]


def closures(shader: str, size: int, samples: int, environment: Environment) -> Weights:
    """A sphere whose surface is the output BSDF of a shader, by Cycles' own light transport.

    Linear RGB, float32 of shape (2, size, size, 3): in the light and view of
    :mod:`nacre.mitsuba.sphere`, then in the environment. RuntimeError as for :func:`shade`.
    """
    height, width = environment.pixels.shape[:2]
    # Cycles: u = 1/2 - azimuth about z / (2 pi), and v = 1/2 + elevation / pi.
    azimuth = 2.0 * np.pi * (0.5 - (np.arange(width) + 0.5) / width)
    elevation = (np.pi * ((np.arange(height) + 0.5) / height - 0.5))[:, None]
    flat = np.cos(elevation)
    directions = np.stack(
        np.broadcast_arrays(flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)),
        axis=-1,
    )
    with tempfile.TemporaryDirectory() as folder:
        around = Path(folder, "environment.npy")
        np.save(around, environment.radiance(directions).astype(np.float32))
        return _run(Path(folder), "closures", shader, size, samples, around)[0]


def principled(given: Mapping[str, npt.NDArray[np.floating]]) -> Weights:
    """What a light of irradiance pi, or a white sky, makes of the Principled node.

    Parameters
    ----------
    given
        Angles, normals, tangents and inputs of the node, as `cycles_script.py` takes them.

    Returns
    -------
    Linear RGB, float32 of shape (angles, n, 3)
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "given.npz")
        np.savez(path, **given)
        return _started(Path(folder), "principled", path)[0]


def _run(folder: Path, task: str, shader: str, *arguments: object) -> tuple[Weights, str]:
    """What comes of a shader."""
    source = folder / "shader.osl"
    source.write_text(shader)
    return _started(folder, task, source, *arguments)


def _started(folder: Path, task: str, *arguments: object) -> tuple[Weights, str]:
    """The array that Blender writes, and what it prints."""
    out = folder / "out.npy"
    words = [_SCRIPT, task, *arguments, out]
    done = subprocess.run(
        [os.environ[VARIABLE], *map(str, words)],
        capture_output=True,
        text=True,
        env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
        cwd=folder,
    )
    if done.returncode or not out.exists():
        raise RuntimeError(f"Cycles: {done.stdout}{done.stderr}")
    return np.load(out), done.stdout
