"""Trainings of networks: a table for every page, and curves of losses."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Self

from nacre.figures.page import Figure
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.codecs.networks.journal import COLUMNS
from nacre_lab.reproduce.chart import charts, dress, line_style
from nacre_lab.reproduce.tables import markdown_table
from nacre_lab.reproduce.textures.methods import Method


class Row(NamedTuple):
    """What a training writes down at a step; no validation at most of them."""

    step: int
    seconds: float
    learning_rate: float
    loss: float
    validation: float | None


def read_journal(path: Path) -> list[Row]:
    """Whole rows of a journal; none where there is no file, or it is damaged."""
    try:
        with path.open(newline="", encoding="utf-8", errors="replace") as file:
            header, *rows = csv.reader(file)
        if tuple(header) != COLUMNS:
            return []
        return [
            Row(int(step), float(seconds), float(rate), float(loss), float(last) if last else None)
            for step, seconds, rate, loss, last in (r for r in rows if len(r) == len(COLUMNS))
        ]
    except (OSError, ValueError, csv.Error):
        return []


@dataclass(frozen=True)
class Training:
    """A finished training.

    Parameters
    ----------
    name
        Name of the method.
    steps, epochs
        Its length; every epoch has new random texels of every texture.
    batch
        Texels of a step.
    optimizer, loss
        What was minimized, and how.
    encoder
        Fraction of a texel's entries that the encoder saw in a step, in words.
    compared
        Entries compared by the loss in a step.
    held_out
        Final loss on held-out texels; None if there are none.
    rows
        Rows of its journal.
    """

    name: str
    steps: int
    epochs: float
    batch: int
    optimizer: str
    loss: str
    encoder: str
    compared: int
    held_out: float | None
    rows: Sequence[Row]

    @classmethod
    def of(cls, method: Method, codec: TexelCodec, journal: Path, entries: int) -> Self:
        """The training of a codec, from its metadata, on texels of so many entries."""
        facts: dict[str, Any] = codec.metadata
        recipe = facts["training"]
        batch, steps = int(recipe["batch"]), int(facts["steps"])
        limit = recipe["encoder_directions"] or entries
        most, least = min(1.0, limit / entries), float(recipe["encoder_fraction"])
        if getattr(codec, "fixed_directions", False):
            least = most = 1.0
        share = f"{100 * most:.0f} %"
        if least < most:
            share = f"{100 * least:.0f}–{share}"
        return cls(
            method.name,
            steps,
            float(facts["epochs"]),
            batch,
            recipe["optimizer"],
            recipe["loss"],
            share,
            min(entries, recipe["loss_directions"] or entries),
            facts.get("held out"),
            read_journal(journal),
        )

    @property
    def seconds(self) -> float | None:
        """Its duration; None if unknown."""
        return self.rows[-1].seconds if self.rows else None


def training_table(trainings: Sequence[Training]) -> str:
    """Markdown, one line per network."""
    head = [
        *("network", "steps", "epochs", "texels a step", "optimizer, loss"),
        *("entries the encoder saw", "entries compared", "seconds", "held-out loss"),
    ]
    lines = [
        [
            training.name,
            f"{training.steps:,}",
            f"{training.epochs:.3g}",
            str(training.batch),
            f"{training.optimizer}, {training.loss}",
            training.encoder,
            f"{training.compared:,}",
            "–" if training.seconds is None else f"{training.seconds:,.0f}",
            "–" if training.held_out is None else f"{training.held_out:.4f}",
        ]
        for training in trainings
    ]
    return markdown_table(head, lines)


def training_curves(trainings: Sequence[Training]) -> Figure:
    """Losses on held-out texels against steps, and against minutes."""
    figure, (by_step, by_time) = charts(2, 9.0, 3.6)
    for index, training in enumerate(trainings):
        rows = [row for row in training.rows if row.validation is not None]
        losses = [row.validation for row in rows]
        style = line_style(index)
        by_step.plot([row.step for row in rows], losses, label=training.name, **style)
        by_time.plot([row.seconds / 60.0 for row in rows], losses, **style)
    dress(by_step, x="steps", y="loss on held-out texels", log="xy")
    dress(by_time, x="minutes", log="xy")
    by_step.legend(fontsize=8, frameon=False)
    return figure
