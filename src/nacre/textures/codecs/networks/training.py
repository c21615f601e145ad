"""Training of the networks in PyTorch: in one process or several, on a CPU or a GPU."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError
from nacre.runtime.device import memory_errors, open_device
from nacre.runtime.interrupts import uninterrupted
from nacre.runtime.progress import Progress, silent
from nacre.runtime.store import Store, restore_optimizer
from nacre.textures.codecs.codec import TrainingRun
from nacre.textures.codecs.networks.dataset import Batch, Entries, TexelStream, images_once
from nacre.textures.codecs.networks.distributed import Processes, processes
from nacre.textures.codecs.networks.journal import Journal
from nacre.textures.codecs.networks.mlp import Tensor, direction_inputs, torch
from nacre.textures.codecs.networks.network import DIRECTIONS, TexelNetwork
from nacre.textures.codecs.networks.preprocessing import Whitening
from nacre.textures.codecs.networks.recipe import NetworkRecipe, TrainingRecipe, optimizers

_REPORT_EVERY = 10  # steps between rows of the journal
_FOREVER = 1 << 60
_Orders: TypeAlias = npt.NDArray[np.int64] | None  # of the color channels of texels, (b, 3)
_COMPARED = 512  # entries that the loss on held-out texels compares, at most


def train_network(
    kind: type[TexelNetwork], run: TrainingRun, recipe: NetworkRecipe
) -> TexelNetwork:
    """A network of a kind, trained on the texels of textures, alone or with processes that
    `torchrun` started.

    Given steps, or all epochs, a training that was stopped and resumed gives the same network as
    one that was not, bit by bit on one process. Given minutes, it depends on the machine. Images
    are read once; the first process writes the state and the losses.

    Raises a FormatError if a file cannot be read, or holds values that are not finite, and a
    NacreError if there is nothing to train on, the files have several sets of directions where the
    network takes one, training diverges, the device cannot be used or has too little memory, or the
    state belongs to another training or is damaged.
    """
    with processes(recipe.device) as (members, own), images_once(run.load) as load:
        device = open_device(own)
        training = _Training(kind, replace(run, load=load), recipe, device, members)
        first = members.rank == 0
        with memory_errors(own):
            step = training.resume()
            with Journal(*((run.journal, step, run.events) if first else (None,))) as rows:
                training.run(rows, run.progress if first else silent)
    return training.result()


def _new_network(
    kind: type[TexelNetwork], stream: TexelStream, recipe: NetworkRecipe
) -> TexelNetwork:
    whitening = Whitening.of(stream.sample())
    if kind.fixed_directions and len(stream.directions) > 1:
        raise NacreError(
            f"{stream.examples[1]}: has other directions than {stream.examples[0]}; the files have "
            f"{len(stream.directions)} sets of directions, the network of 2019 takes one: leave "
            "out the others, or train a unified one"
        )
    chosen: dict[str, Any] = {"seed": recipe.training.seed, "variance": recipe.training.variance}
    if kind.fixed_directions:
        chosen |= zip(DIRECTIONS, stream.directions[0], strict=True)
    return kind(settings=recipe.settings, whitening=whitening, **chosen)


class _Training:
    def __init__(
        self,
        kind: type[TexelNetwork],
        run: TrainingRun,
        whole: NetworkRecipe,
        device: Any,
        members: Processes,
    ) -> None:
        recipe, self._steps = whole.training, whole.steps
        self._minutes, self._save_every = whole.minutes, whole.save_every
        stream = TexelStream(
            run.paths, run.load, recipe.batch, recipe.texels, held_out=recipe.held_out,
            entries=partial(_needed, recipe, kind.fixed_directions), seed=recipe.seed,
            rank=members.rank, size=members.size,
        )  # fmt: skip
        if self._minutes is None and self._steps is None:
            self._steps = recipe.epochs * stream.epoch_steps
        network = _new_network(kind, stream, whole).to(device)
        self._network, self._stream, self._recipe = network, stream, recipe
        self._device, self._members = device, members
        self._parameters = list(network.parameters.values())
        for parameter in self._parameters:
            parameter.requires_grad_()
        self._optimizers = optimizers(self._parameters, recipe)
        inputs = (torch.from_numpy(direction_inputs(*pair)) for pair in stream.directions)
        self._inputs = [pairs.to(device) for pairs in inputs]
        self._held_out = stream.held_out()
        sizes = [stream.epoch_steps, *(len(wi) for wi, _ in stream.directions)]
        about = f"{network.kind} {network.settings} {recipe} {stream.names} {sizes}"
        length = f"{run.fingerprint} {self._steps} {self._minutes}"
        self._store = Store(run.state, f"{about} {length}")
        self._step, self._seconds, self._loss = 0, 0.0, math.inf
        self._recent = torch.zeros((), device=device)
        self._validation: float | None = None
        self._best: dict[str, Any] = {"loss": math.inf, "step": 0, "parameters": []}

    def resume(self) -> int:
        """Load the state that was kept; gives the step."""
        state = self._store.load()
        if state is None:
            return 0
        with self._store.readable():
            for optimizer, saved in zip(self._optimizers, state["optimizers"], strict=True):
                restore_optimizer(optimizer, saved)
            self._set_parameters(state["parameters"])
            self._recent.copy_(state["recent"])
            self._loss, self._seconds = float(state["loss"]), float(state["seconds"])
            best, validation = state["best"], state["validation"]
            self._best = {"loss": float(best["loss"]), "step": int(best["step"])}
            self._best["parameters"] = kept = list(best["parameters"])
            if kept and [p.shape for p in kept] != [p.shape for p in self._parameters]:
                raise ValueError("the best parameters belong to another network")
            self._validation = None if validation is None else float(validation)
            self._step = int(state["step"])
        return self._step

    def _save(self) -> None:
        if self._members.rank:
            return
        state = {
            "optimizers": [optimizer.state_dict() for optimizer in self._optimizers],
            "parameters": [p.detach() for p in self._parameters],
            "recent": self._recent,
            "loss": self._loss,
            "seconds": self._seconds,
            "best": self._best,
            "validation": self._validation,
            "step": self._step,
        }
        with uninterrupted():
            self._store.save(state)

    def _set_parameters(self, values: Sequence[Tensor]) -> None:
        for mine, saved in zip(self._parameters, values, strict=True):
            mine.data.copy_(saved)

    def run(self, journal: Journal, report: Progress) -> None:
        last, minutes = _FOREVER if self._steps is None else self._steps, self._minutes
        before = time.monotonic()
        batches = self._stream.batches(self._step, last)
        try:
            while self._step < last and not self._patience_over():
                batch = next(batches)
                with uninterrupted():
                    done = self._step / last
                    if minutes is not None:
                        done = self._members.agree(self._seconds / (60.0 * minutes), self._device)
                        if done >= 1.0:
                            break
                    rate = self._recipe.rate(done)
                    self._descend(batch, rate)
                    now = time.monotonic()
                    self._seconds, before = self._seconds + now - before, now
                    validated = self._step % self._recipe.validate_every == 0
                    if validated:
                        self._validate()
                    if self._step % _REPORT_EVERY == 0 or self._step == last:
                        self._take_loss()
                        if self._step != last:
                            self._note(journal, rate, validated)
                    if self._store.due(self._save_every):
                        self._save()
                done = self._seconds if minutes else self._step
                total = 60.0 * minutes if minutes else last
                note = "" if self._validation is None else f", held out {self._validation:.4f}"
                report("training", int(done), int(total), f"loss {self._loss:.4f}{note}")
            self._validate()
            if journal.last != self._step:
                self._note(journal, self._recipe.rate(1.0), True)
            # A training interrupted before the caller has written the network resumes here.
            self._save()
        except KeyboardInterrupt:
            self._save()
            raise
        finally:
            batches.close()

    def _descend(self, batch: Batch, rate: float) -> None:
        for optimizer in self._optimizers:
            for group in optimizer.param_groups:
                group["lr"] = rate
            optimizer.zero_grad()
        recipe, each = self._recipe, len(batch.values)
        count = len(self._inputs[batch.group])
        fixed = self._network.fixed_directions
        seen, compared, random = _drawn(recipe, fixed, self._step, count)
        orders = None
        if recipe.permute:
            first = self._members.rank * each
            orders = random.random((recipe.batch, 3)).argsort(axis=1)[first : first + each]
        loss = self._losses(batch, seen, compared, orders)
        loss.backward()
        self._members.average_gradients(self._parameters)
        for optimizer in self._optimizers:
            optimizer.step()
        self._recent += loss.detach()
        self._step += 1

    def _losses(self, batch: Batch, seen: Entries, compared: Entries, orders: _Orders) -> Tensor:
        """Mean difference of whitened logarithms."""
        network, inputs = self._network, self._inputs[batch.group]
        order = None if orders is None else torch.from_numpy(orders).to(self._device)

        def part(chosen: Entries) -> tuple[Tensor, Tensor]:
            """Whitened texels with permuted channels, shape (b, k, 3), and directions."""
            values = torch.from_numpy(batch.values)
            if chosen is not None:
                here = chosen if batch.entries is None else batch.entries.searchsorted(chosen)
                values = values[:, torch.from_numpy(here)]
            whitened = network.whitening.whiten(values.to(self._device))
            if order is not None:
                whitened = whitened.take_along_dim(order[:, None], 2)
            if chosen is None:
                return whitened, inputs
            return whitened, inputs[torch.from_numpy(chosen).to(self._device)]

        texels, directions = part(seen)
        goal, where = part(compared)
        half = self._recipe.precision == "bfloat16"
        with torch.autocast(self._device.type, torch.bfloat16, enabled=half):
            codes = network.encode(texels.mT, network.prepare_encoder(directions))
            found = network.decode(codes, network.prepare_decoder(where))
        difference = found.float() - goal
        return (difference.abs() if self._recipe.loss == "l1" else difference.square()).mean()

    def _take_loss(self) -> None:
        """Set the loss to the mean since the last time."""
        taken = self._step % _REPORT_EVERY or _REPORT_EVERY
        self._loss = float(self._recent.item()) / taken
        self._recent.zero_()
        if not math.isfinite(self._loss):
            raise NacreError(
                f"training diverged at step {self._step:,}; remove the state, if there is "
                "one, and lower the learning rate"
            )

    def _note(self, journal: Journal, rate: float, validated: bool) -> None:
        validation = self._validation if validated else None
        journal.add(self._step, self._seconds, rate, self._loss, validation)

    def _validate(self) -> None:
        if not self._held_out:
            return
        total, count = 0.0, 0
        with torch.no_grad():
            for index, held in enumerate(self._held_out):
                random = np.random.default_rng((self._recipe.seed, 5, index))
                entries = len(self._inputs[held.group])
                limit = None if self._network.fixed_directions else self._recipe.encoder_directions
                seen = _chosen(random, entries, limit)
                compared = _chosen(random, entries, _COMPARED)
                for start in range(0, len(held.values), self._recipe.batch):
                    values = held.values[start : start + self._recipe.batch]
                    loss = self._losses(Batch(values, held.group), seen, compared, None)
                    total += float(loss.item()) * len(values)
                    count += len(values)
        self._validation = total / count
        if self._recipe.patience and self._validation < self._best["loss"]:
            parameters = [p.detach().clone() for p in self._parameters]
            self._best = {"loss": self._validation, "step": self._step, "parameters": parameters}

    def _patience_over(self) -> bool:
        """Whether as many validations as patience allows found nothing better."""
        allowed = self._recipe.patience * self._recipe.validate_every
        return bool(allowed and self._held_out and self._step - self._best["step"] >= allowed)

    def result(self) -> TexelNetwork:
        """The network as it is now, or its best with patience, with facts about it."""
        network, step, validation = self._network, self._step, self._validation
        if self._best["parameters"]:
            self._set_parameters(self._best["parameters"])
            step, validation = self._best["step"], self._best["loss"]
        facts = {"materials": self._stream.names, "training": asdict(self._recipe)}
        loss = self._loss if math.isfinite(self._loss) else None
        epochs = step / self._stream.epoch_steps
        metadata = facts | {"steps": step, "epochs": epochs, "loss": loss, "held out": validation}
        return network.to("cpu").replaced(metadata=metadata)


def _drawn(
    recipe: TrainingRecipe, fixed_directions: bool, step: int, count: int
) -> tuple[Entries, Entries, np.random.Generator]:
    """Which of `count` entries the encoder sees at a step, which the loss compares, and the
    generator for the rest of the step's random numbers.
    """
    random = np.random.default_rng((recipe.seed, 4, step))
    seen = None
    if not fixed_directions:
        fraction = random.uniform(recipe.encoder_fraction, 1.0)
        limit = count if recipe.encoder_directions is None else recipe.encoder_directions
        seen = _chosen(random, count, min(limit, math.ceil(fraction * count)))
    return seen, _chosen(random, count, recipe.loss_directions), random


def _needed(recipe: TrainingRecipe, fixed_directions: bool, step: int, count: int) -> Entries:
    seen, compared, _ = _drawn(recipe, fixed_directions, step, count)
    return None if seen is None or compared is None else np.union1d(seen, compared)


def _chosen(random: np.random.Generator, count: int, limit: int | None) -> Entries:
    """Some of `count` entries in their order, at most `limit`; None for all."""
    if limit is None or limit >= count:
        return None
    return np.sort(random.permutation(count)[:limit])
