"""ONNX models in onnxruntime, on one thread."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import best_rate
from tests.oracles.texture_runner import TextureRunner
from tests.oracles.textures import Points

_BATCH = 4096  # more take longer each, as tables of rows no longer fit into the cache
_OUTPUTS = {"eval": ("rgb",), "pdf": ("pdf",), "sample": ("wi", "pdf")}


class OnnxRuntime(TextureRunner):
    """onnxruntime's CPU provider."""

    target = "onnx"
    title = "onnxruntime"
    functions = tuple(_OUTPUTS)

    def missing(self) -> str | None:
        """See :class:`TextureRunner`."""
        wanted = "onnx", "onnxruntime"
        return next((name for name in wanted if importlib.util.find_spec(name) is None), None)

    def run(self, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Weights:
        """See :class:`TextureRunner`."""
        return _prepared(files, name, function, points)()

    def rate(self, files: Mapping[str, bytes], name: str, points: Points) -> float:
        """See :class:`TextureRunner`."""
        return best_rate(_prepared(files, name, "eval", points), len(points.wi))


def _prepared(
    files: Mapping[str, bytes], name: str, function: str, points: Points
) -> Callable[[], Weights]:
    """What computes a function of points, shape (n, k)."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(files[f"{name}_{function}.onnx"], options)
    given = {"wi": points.wi, "u": points.wi, "wo": points.wo, "uv": points.uv}
    given["level"] = points.level
    inputs = {each.name: given[each.name] for each in session.get_inputs()}
    count = len(points.wi)

    def execute() -> Weights:
        parts = []
        for start in range(0, count, _BATCH):
            batch = {key: values[start : start + _BATCH] for key, values in inputs.items()}
            found = session.run(list(_OUTPUTS[function]), batch)
            parts.append(np.concatenate([one.reshape(len(one), -1) for one in found], axis=1))
        return np.concatenate(parts)

    return execute
