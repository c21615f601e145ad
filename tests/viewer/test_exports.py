"""Code that the page writes, character by character what the export targets write."""

from __future__ import annotations

import itertools
import json
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.brdf import CosineSampler
from nacre.neural.file import encode, load
from nacre.neural.inputs import INPUTS, input_count, rotates_half_vector
from nacre.neural.nbrdf import ACTIVATIONS, NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.sampling import GgxLobe, GgxMixture
from nacre.targets.files import contents
from nacre.viewer.exports import hold, shared
from nacre.viewer.page import script

TARGETS = "glsl", "wgsl", "three"
ODD = '*/ Gold -- "90 %" ünd\nmore'
RUN = """
import fs from "node:fs";
const [folder, count] = process.argv.slice(2);
const held = JSON.parse(fs.readFileSync(`${folder}/held.json`));
for (let k = 0; k < count; k++) {
  const bytes = fs.readFileSync(`${folder}/${k}.safetensors`);
  const file = of_tensors.readTensors(new Uint8Array(bytes).buffer);
  for (const target of held.asked[k]) {
    const { name, text } = of_exports.exported(target, held, file, file.header.name);
    fs.writeFileSync(`${folder}/${k} ${target} ${name}`, text);
  }
}
"""


def made(inputs: str, isotropic: bool, activation: str, angle: float, seed: int) -> NeuralBrdf:
    """A network of random numbers; some of its units are never active, its lobes alike in parts."""
    random = np.random.default_rng(seed)
    layers = []
    sizes = input_count(inputs, isotropic), 9, 7, 3
    for rows, columns in itertools.pairwise(sizes):
        weights = random.normal(0.0, 0.7, (rows, columns)).astype(np.float16)
        biases = random.normal(-0.5, 1.0, columns).astype(np.float16)
        layers.append(Layer(weights.astype(np.float32), biases.astype(np.float32)))
    layers[0].biases[::4] = -40.0
    same, values = (0.25, 0.25, 0.25), tuple(random.uniform(0.1, 0.3, 3).round(4).tolist())
    lobe = GgxLobe(same, values, values, (0.0, 0.0, 1.0))
    axis = None if isotropic else angle
    sampler = GgxMixture(
        (lobe, lobe)[: 1 + seed % 2], values, (0.0, 0.0, 0.0), (0.1, 0.45, 1), axis
    )
    return NeuralBrdf(
        layers,
        isotropic=isotropic,
        inputs=inputs,
        activation=activation,
        angle=angle if inputs == "enhanced" and not isotropic else 0.0,
        precision="half",
        name=ODD,
        sampler=sampler,
        metadata={
            "fit": {"gain": 32.0},
            "quality": {"held_out_loss": 0.0123456},
            "source": {
                "file": "a b.bsdf",
                "sha256": "0" * 64,
                "terms": "CC0 -- \N{COPYRIGHT SIGN}",
            },
        },
    ).replaced(notes=("A note.",))


def networks(kinds: Iterable[str]) -> Iterable[NeuralBrdf]:
    seed = 0
    for inputs in kinds:
        for isotropic in (True, False):
            if isotropic and not rotates_half_vector(inputs, True):
                continue
            for activation, angle in zip(ACTIVATIONS, (0.0, 0.4), strict=True):
                seed += 1
                yield made(inputs, isotropic, activation, angle, seed)


def others() -> Iterable[NeuralBrdf]:
    plain = made("paper", True, "relu", 0.0, 1)
    yield plain.replaced(name="", metadata={}, sampler=CosineSampler(), channels=("a", "b", "c"))
    for name in ("nielsen:greencloth", "rgl:cc_ibiza_sunset"):
        yield included(name)


def included(name: str) -> NeuralBrdf:
    network = nacre.load(name)
    assert isinstance(network, NeuralBrdf)
    return network


def check(folder: Path, made: Iterable[NeuralBrdf], targets: int = len(TARGETS)) -> None:
    """Write all of them in Node.js by the page's modules, for some targets each, and compare."""
    if not shutil.which("node"):
        pytest.skip("node is not installed")
    held, files = shared(), []
    for k, network in enumerate(made):
        path = folder / f"{k}.safetensors"
        path.write_bytes(encode(network))
        read = load(path)
        assert isinstance(read, NeuralBrdf)
        files.append(read)
        hold(read.sampler, held["samplers"])
    asked = [[TARGETS[(k + i) % len(TARGETS)] for i in range(targets)] for k in range(len(files))]
    (folder / "held.json").write_text(json.dumps({**held, "asked": asked}))
    (folder / "run.mjs").write_text(script("exports") + RUN)
    command = ["node", str(folder / "run.mjs"), str(folder), str(len(files))]
    subprocess.run(command, check=True, timeout=600)
    for k, network in enumerate(files):
        for target in asked[k]:
            ((name, expected),) = contents(network, target).items()
            found = (folder / f"{k} {target} {name}").read_bytes().decode()
            assert found.splitlines() == expected.decode().splitlines(), f"{k} {target}"
            assert found == expected.decode()


@pytest.mark.slow
def test_code_is_that_of_the_targets(tmp_path: Path) -> None:
    check(tmp_path, others())


@pytest.mark.slow
def test_code_of_all_inputs_is_that_of_the_targets(tmp_path: Path) -> None:
    check(tmp_path, networks(INPUTS))


@pytest.mark.slow
def test_code_of_all_included_networks_is_that_of_the_targets(tmp_path: Path) -> None:
    """What differs between them are numbers, which targets write alike: each in one is enough."""
    check(tmp_path, [included(m.name) for m in nacre.materials() if m.kind == "brdf"], targets=1)
