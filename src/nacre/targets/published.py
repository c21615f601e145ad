"""Networks in the files of the NBRDF paper's authors, for their scripts and their plugin.

`npy` is what `nbrdf_npy`, their plugin for Mitsuba 0.6, reads if `nn_basename` is NAME_. `h5` is
for their `load_model`: weights, and the layers as JSON. Their own files end in a Keras layer of
Python code, exp(x) - 1, which is left out here: outputs are log(f_r + 1).
"""

from __future__ import annotations

import io
import itertools
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.neural.inputs import PAPER
from nacre.neural.nbrdf import HIDDEN, OUTPUTS, NeuralBrdf
from nacre.neural.published import KERAS_VERSION, keras_bytes
from nacre.numerics.mlp import RELU
from nacre.targets.target import Target
from nacre.targets.text import preamble

_SIZES = (6, *HIDDEN, OUTPUTS)


class _Published(Target):
    """The authors' code takes isotropic networks with the paper's inputs and sizes."""

    def network(self, material: Brdf | Btf) -> NeuralBrdf:
        """The material, if it is such a network; NacreError otherwise."""
        brdf = self.reflectance(material)
        if isinstance(brdf, NeuralBrdf):
            found = brdf.sizes, brdf.inputs, brdf.activation, brdf.isotropic
            if found == (_SIZES, PAPER, RELU, True):
                return brdf
        sizes = "-".join(map(str, _SIZES))
        raise NacreError(
            f"{brdf.name or 'this material'}: the authors' code takes isotropic networks {sizes} "
            "of the paper's inputs: make one by nacre fit --inputs paper, or export it --to onnx"
        )


class Npy(_Published):
    title = "the NBRDF authors' NumPy files, for their plugin for Mitsuba 0.6"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        network = self.network(material)
        files = {f"{name}.txt": "\n".join([*preamble(network), ""]).encode()}
        for index, layer in enumerate(network.layers, 1):
            for part, values in zip(("fc", "b"), layer, strict=True):
                content = io.BytesIO()
                np.lib.format.write_array(content, values.astype("<f4"), (1, 0))
                files[f"{name}_{part}{index}.npy"] = content.getvalue()
        return files


class H5(_Published):
    title = "the NBRDF authors' Keras files, for their Python code"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        network = self.network(material)
        return {
            f"{name}.h5": keras_bytes(network.layers, "\n".join(preamble(network))),
            f"{name}.json": _model(name).encode(),
        }


def _model(name: str) -> str:
    """The layers in Keras's JSON, in a form that its versions 2 and 3 understand."""
    layers = []
    for index, (inputs, outputs) in enumerate(itertools.pairwise(_SIZES), 1):
        last = index == len(_SIZES) - 1
        settings: dict[str, Any] = {"name": f"dense_{index}", "units": outputs, "use_bias": True}
        settings["activation"] = "linear" if last else "relu"
        if index == 1:
            settings["input_shape"] = [inputs]
        layers.append({"class_name": "Dense", "module": "keras.layers", "config": settings})
    model = {
        "class_name": "Sequential",
        "module": "keras",
        "registered_name": None,
        "config": {"name": name, "layers": layers},
        "keras_version": KERAS_VERSION,
        "backend": "tensorflow",
    }
    return json.dumps(model, indent=1) + "\n"
