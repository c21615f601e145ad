"""Tasks of `addon_script.py`, run where there is a Blender."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Weights
from tests.oracles.blender import VARIABLE

_SCRIPT = Path(__file__).with_name("addon_script.py")


def run(task: str, *arguments: object) -> tuple[dict[str, Any], Weights]:
    """What a task finds, and its pictures; an empty array where it has none.

    Blender keeps its preferences in a folder of the task. RuntimeError if it fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "out")
        done = subprocess.run(
            [os.environ[VARIABLE], *map(str, (_SCRIPT, task, *arguments, out))],
            capture_output=True,
            text=True,
            env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
            | {"BLENDER_USER_RESOURCES": str(Path(folder, "user"))},
            cwd=folder,
        )
        report, pictures = out.with_suffix(".json"), out.with_suffix(".npy")
        if done.returncode or not report.exists():
            raise RuntimeError(f"Blender: {done.stdout}{done.stderr}")
        found = json.loads(report.read_text())
        return found, np.load(pictures) if pictures.exists() else np.empty(0)
