"""Run the notebooks of docs, and keep their outputs: `python scripts/notebooks.py [FILE...]`.

They run in empty folders. What changes from run to run or tells about the machine is left out:
times, versions and addresses of objects. Pictures are JPEGs where those are smaller.
"""

from __future__ import annotations

import base64
import io
import os
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from PIL import Image

NOTEBOOKS = sorted((Path(__file__).parents[1] / "docs" / "notebooks").glob("*.ipynb"))

_QUALITY = 90


def executed(path: Path) -> Any:
    """A notebook with the outputs of its cells; one that fails raises a CellExecutionError."""
    notebook = nbformat.read(path, as_version=4)
    metadata = dict(notebook.metadata)
    commands = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            notebook,
            startup_timeout=600,
            timeout=600,
            record_timing=False,
            coalesce_streams=True,
            resources={"metadata": {"path": folder}},
            extra_arguments=["--log-level=ERROR"],  # it warns of every connection
        )
        client.execute(env=os.environ | {"PATH": commands})
    notebook.metadata = nbformat.from_dict(metadata)
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            output.get("metadata", {}).clear()
            if "data" in output:
                _tidy(output.data)
            if "text" in output:
                output.text = re.sub(r", [\d.]+ s$", "", output.text, flags=re.M)
    return notebook


def _tidy(data: dict[str, Any]) -> None:
    """One picture instead of two, and no addresses of objects."""
    if png := data.get("image/png"):
        jpeg, file = io.BytesIO(), io.BytesIO(base64.b64decode(png))
        Image.open(file).convert("RGB").save(jpeg, "JPEG", quality=_QUALITY, optimize=True)
        smaller = jpeg.tell() < file.getbuffer().nbytes
        data.pop("image/png" if smaller else "image/jpeg", None)
        if smaller:
            data["image/jpeg"] = base64.b64encode(jpeg.getvalue()).decode()
    if text := data.get("text/plain"):
        data["text/plain"] = re.sub(r" at 0x[0-9A-Fa-f]+", "", text)


if __name__ == "__main__":
    for path in [Path(name) for name in sys.argv[1:]] or NOTEBOOKS:
        nbformat.write(executed(path), path)
        print(f"{path.name}: {path.stat().st_size:,} bytes", flush=True)
