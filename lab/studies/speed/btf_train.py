"""Training, encoding and decoding of textures, beside the literal form and the peak of matrices.

Everything takes turns on random texels at the directions of Bonn's dome: single-precision products
of large square matrices, whose speed is the peak; steps of the unified network of Rainer et al.
2020 in the paper's words, a texel at a time, and of the default recipe; what moves its weights, and
PyTorch's Muon beside it; encoding and decoding by that network, whose weights are random here, and
by the default codec.
`python -m lab.studies.speed.btf_train --help`.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from lab.studies.study import Study, log
from nacre.errors import require
from nacre.measured.textures import BONN
from nacre.runtime.parallel import core_count
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.codecs.codec_file import PUBLISHED, load_codec
from nacre.textures.codecs.networks import UnifiedNetwork, UnifiedSettings, Whitening
from nacre.textures.codecs.networks.mlp import direction_inputs
from nacre.textures.codecs.networks.recipe import TrainingRecipe, optimizers
from tests.oracles.unified_2020 import literal_codes, literal_values, literal_weights

torch: Any = require("torch", "btf")

RECIPE = TrainingRecipe()
ENCODER, LOSS = RECIPE.encoder_directions or 0, RECIPE.loss_directions or 0
"""Entries that a step of the default recipe encodes, and compares."""


def literal_step(network: Any, values: Any, directions: Any) -> Callable[[], Any]:
    """A step on whole texels: one weight for each product, the decoder on every entry."""

    def step() -> None:
        weights = literal_weights(directions, network.parameters)
        loss: Any = 0.0
        for texel in values:
            code = literal_codes(texel, weights, network.parameters)
            found = literal_values(code, directions, network.parameters)
            loss = loss + (found - texel).abs().mean()
        loss.backward()

    return step


def step_on_entries(
    network: Any, values: Any, directions: Any, entries: tuple[int, int], half: bool = False
) -> Callable[[], Any]:
    """A step on some entries of texels."""
    random = np.random.default_rng(1)
    seen, compared = (
        torch.from_numpy(np.sort(random.permutation(len(directions))[:n])) for n in entries
    )

    def step() -> None:
        with torch.autocast(values.device.type, torch.bfloat16, enabled=half):
            prepared = network.prepare_encoder(directions[seen])
            codes = network.encode(values[:, seen].mT, prepared)
            found = network.decode(codes, network.prepare_decoder(directions[compared]))
        (found.float() - values[:, compared]).abs().mean().backward()

    return step


def multiply_adds(run: Callable[[], Any]) -> float:
    """Multiply-adds of the matrix products that something does."""
    from torch.utils.flop_counter import FlopCounterMode

    with FlopCounterMode(display=False) as counter:
        run()
    return float(counter.get_total_flops()) / 2.0


def codec_multiply_adds(codec: BasisCodec, pairs: int) -> tuple[float, float]:
    """Those of the default codec for a texel: encoding, decoding."""
    values, count = codec.decode.linear.shape
    _, *others = codec.decode.layers
    jacobian = values * (sum(int(layer.weights.size) for layer in others) + values * count)
    complete, encode, decode = (
        network.linear.size + sum(layer.weights.size for layer in network.layers)
        for network in (codec.complete, codec.encode, codec.decode)
    )
    guess = complete + encode + 3 * count**2
    return pairs * count + guess + 2 * (jacobian + decode), pairs * count + decode


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--device", default="cpu", help="PyTorch device (default: %(default)s)")
    study.add_argument("--batch", type=int, default=RECIPE.batch, help="texels of a default step")
    study.add_argument("--literal", type=int, default=2, help="texels of a literal step, 1 or more")
    study.add_argument("--texels", type=int, default=512, help="that are encoded at once")
    study.add_argument("--decoded", type=int, default=16, help="texels that are decoded at once")
    study.add_argument("--rounds", type=int, default=5, help="of each that are timed")
    options = study.options()
    if options.literal < 1:
        study.error("--literal: 1 texel or more")
    torch.set_num_threads(core_count())
    wi, wo = BONN.pairs()
    codec = UnifiedNetwork(UnifiedSettings(), Whitening(0.0, 1.0))  # encodes on the processor
    network = codec.to(options.device)
    trained = UnifiedNetwork(UnifiedSettings(), Whitening(0.0, 1.0)).to(options.device)
    for parameter in trained.parameters.values():
        parameter.requires_grad_()
    random = np.random.default_rng(0)
    texels = random.random((options.texels, len(wi), 3), np.float32)
    directions = torch.from_numpy(direction_inputs(wi, wo)).to(options.device)
    values = torch.from_numpy(texels[: options.batch]).to(options.device)
    codes = random.normal(size=(options.decoded, 32)).astype(np.float32)
    encode, decode = codec.encoder(wi, wo), codec.decoder(wi, wo)
    basis = load_codec(PUBLISHED)
    assert isinstance(basis, BasisCodec)
    basis_encode, basis_decode = (
        on_all_cores(basis, run) for run in (basis.encoder(wi, wo), basis.decoder(wi, wo))
    )
    many = random.normal(size=(options.texels, basis.code_dim)).astype(np.float32)
    square = torch.randn(2048, 2048, device=options.device)

    ours = optimizers(list(trained.parameters.values()), RECIPE)
    matrices = ours[0].param_groups[0]["params"]
    pytorch = torch.optim.Muon(matrices, adjust_lr_fn="match_rms_adamw")

    def moves(optimizers: Sequence[Any]) -> None:
        for optimizer in optimizers:
            optimizer.step()

    few, ten = values[: options.literal], values[:10]
    channels = values.permute(2, 0, 1).contiguous()
    weights = literal_weights(directions, network.parameters).transpose(0, 1).contiguous()
    some, every = (ENCODER, LOSS), (len(wi), len(wi))
    subjects: dict[str, tuple[int, Callable[[], Any]]] = {
        "product of matrices of 2048": (1, lambda: square @ square),
        "step, literal": (len(few), literal_step(trained, few, directions)),
        "step, all entries": (len(ten), step_on_entries(trained, ten, directions, every)),
        "step, default": (len(values), step_on_entries(trained, values, directions, some)),
        "step, default, bfloat16": (
            len(values),
            step_on_entries(trained, values, directions, some, half=True),
        ),
        "weights, default": (len(values), lambda: moves(ours)),
        "weights, PyTorch's Muon": (len(values), lambda: moves([pytorch])),
        "encode, a product a channel alone": (len(values), lambda: torch.bmm(channels, weights)),
        "encode": (len(texels), lambda: encode(texels)),
        "decode": (len(codes), lambda: decode(codes)),
        "encode, default codec": (len(texels), lambda: basis_encode(texels)),
        "decode, default codec": (len(many), lambda: basis_decode(many)),
    }
    work = {name: multiply_adds(run) for name, (_, run) in subjects.items()}
    # What threads do is not counted, so it is counted once more without them.
    prepared = network.prepare_encoder(directions), network.prepare_decoder(directions)
    given = torch.from_numpy(codes).to(options.device)
    work["encode"] = multiply_adds(lambda: network.encode(few.mT, prepared[0]))
    work["encode"] *= len(texels) / len(few)
    work["decode"] = multiply_adds(lambda: network.decode(given[:1], prepared[1])) * len(codes)
    by_basis = codec_multiply_adds(basis, len(wi))
    work["encode, default codec"] = by_basis[0] * len(texels)
    work["decode, default codec"] = by_basis[1] * len(many)
    seconds: dict[str, list[float]] = {name: [] for name in subjects}
    for _ in range(options.rounds):
        for name, (_, run) in subjects.items():
            start = time.perf_counter()
            run()
            if options.device != "cpu":
                torch.cuda.synchronize()
            seconds[name].append(time.perf_counter() - start)
            log(f"{name}: {seconds[name][-1]:.4f} s")
    best = {name: statistics.median(taken) for name, taken in seconds.items()}
    speed = {name: work[name] / best[name] for name in subjects}
    peak = next(iter(speed.values()))
    rows = []
    for name, (count, _) in subjects.items():
        each = 1e3 * best[name] / count
        rows.append(
            (
                name,
                str(count),
                f"{1e3 * best[name]:.1f}",
                f"{each:.3g}",
                f"{work[name] / count / 1e6:,.1f}",
                f"{speed[name] / peak:.2f}",
            )
        )
    columns = ("", "texels", "ms", "ms a texel", "M multiply-adds a texel", "of sgemm")
    name = torch.cuda.get_device_name(options.device) if "cuda" in options.device else "CPU"
    study.table(
        columns,
        rows,
        note=f"{len(wi):,} entries a texel; default steps encode {ENCODER:,} and compare "
        f"{LOSS:,} of them; {core_count()} cores; {name}; {torch.__version__}; peak "
        f"{2e-9 * peak:.0f} GFLOP/s.",
    )


if __name__ == "__main__":
    main()
