"""ONNX models in onnxruntime, on the processor."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from typing import Any

import numpy as np

from nacre.array import Weights
from nacre.runtime.parallel import core_count
from tests.oracles.runner import Runner, best_rate

BATCH = 1 << 14  # pairs whose tensors stay in the cache of the second level


class OnnxRuntime(Runner):
    """See :mod:`tests.oracles.runners.onnx`.

    Parameters
    ----------
    threads
        How many a session has; one a core where None.
    """

    target, title = "onnx", "onnxruntime"

    def __init__(self, threads: int | None = None) -> None:
        self.threads = threads or core_count()

    def missing(self) -> str | None:
        """See :class:`Runner`."""
        return None if find_spec("onnxruntime") else "onnxruntime"

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        """See :class:`Runner`."""
        session = self._session(files[f"{name}_{function}.onnx"])
        inputs = [each.name for each in session.get_inputs()]
        found = []
        for start in range(0, len(a), BATCH):
            part = slice(start, start + BATCH)
            outputs = session.run(None, dict(zip(inputs, (a[part], b[part]), strict=True)))
            columns = [each[:, None] if each.ndim == 1 else each for each in outputs]
            found.append(np.concatenate(columns, axis=1))
        joined: Weights = np.concatenate(found)
        return joined[:, 0] if function == "pdf" else joined

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        """See :class:`Runner`; batch after batch of :data:`BATCH`, whose memory is in place."""
        count = min(len(a), BATCH)
        session = self._session(files[f"{name}_eval.onnx"])
        binding = session.io_binding()
        for each, values in zip(session.get_inputs(), (a, b), strict=True):
            binding.bind_cpu_input(each.name, np.ascontiguousarray(values[:count]))
        binding.bind_output(session.get_outputs()[0].name)
        rounds = max(1, len(a) // count)

        def call() -> None:
            for _ in range(rounds):
                session.run_with_iobinding(binding)

        return best_rate(call, rounds * count)

    def _session(self, model: bytes) -> Any:
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = self.threads
        options.log_severity_level = 3
        try:
            return onnxruntime.InferenceSession(model, options, ["CPUExecutionProvider"])
        except Exception as error:  # classes of its own, for each status
            raise RuntimeError(str(error)) from error
