"""How help is laid out: options and commands under headings, in columns that line up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import click

from nacre.cli.ranges import IntRange, in_words, number_in_words

SUBJECTS = {
    "brdf": "reflectances (BRDFs)",
    "btf": "textures (BTFs)",
    "network": "networks",
    "codec": "unified and custom codecs",
    "scene": "Mitsuba scenes (.xml)",
}
"""Kinds of materials and models that an option may be limited to."""

SHARED = {"dry-run", "json", "force", "quiet", "verbose", "version", "help"}
"""Names of the options that commands share."""

_FIRST, _SHARED = "Options", "Shared options"
_WIDEST = 20
"""Columns for names; text goes below a longer name."""

Sections: TypeAlias = Mapping[str, Sequence[tuple[str, str]]]
"""Names and texts under headings."""


class Option(click.Option):
    """An option under a heading of the help, maybe limited to one kind of material or model.

    Parameters
    ----------
    names
        As click takes them.
    applies
        The kind that it is limited to, a key of :data:`SUBJECTS`; see
        :func:`nacre.cli.options.refuse`.
    group
        What it is about, if not the kind: it stands under "Options for `group`".
    first
        Whether it stands under the first heading, "Options", although it is limited to one kind.
    shown
        The default in words.
    settings
        As click takes them.
    """

    def __init__(
        self,
        names: Sequence[str],
        applies: str = "",
        group: str = "",
        first: bool = False,
        shown: str = "",
        **settings: Any,
    ) -> None:
        super().__init__(names, **settings)
        self.applies, self.shown = applies, shown
        self.group = "" if first else group or SUBJECTS.get(applies, "")
        if self.metavar is None:
            if isinstance(self.type, click.IntRange | click.FloatRange):
                self.metavar = "N" if isinstance(self.type, click.IntRange) else "X"
            elif isinstance(self.type, click.Choice):
                self.metavar = "|".join(self.type.choices)

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """See click; the text ends in what the option is for, its range and its default."""
        record = super().get_help_record(ctx)
        if record is None:
            return None
        default = self.default_in_words(ctx)
        facts = [*self.limits(), *([f"default: {default}"] if default else [])]
        return record[0], f"{self.help} [{'; '.join(facts)}]" if facts else self.help or ""

    def limits(self) -> list[str]:
        """Whether the option is required, the kind it is for unless the heading says it, and its
        range unless that goes without saying.
        """
        limits = ["required"] if self.required else []
        if self.applies and not self.group:
            limits.append(f"for {SUBJECTS[self.applies].partition(' (')[0]}")
        kind = self.type
        if isinstance(kind, click.IntRange | click.FloatRange) and not _obvious(kind):
            limits.append(in_words(kind))
        return limits

    def default_in_words(self, ctx: click.Context) -> str:
        """The default, as help shows it; empty if there is none."""
        default = self.get_default(ctx, call=False)
        if self.shown:
            return self.shown
        if isinstance(default, bool):
            names = self.opts if default else self.secondary_opts
            return names[0].lstrip("-") if self.secondary_opts else ""
        if isinstance(default, int | float):
            return number_in_words(default)
        return default if isinstance(default, str) else ""


def _obvious(kind: click.IntRange | click.FloatRange) -> bool:
    """Whether a range goes without saying: a count of one or more, or any seed."""
    return isinstance(kind, IntRange) and (
        (kind.min, kind.max) == (1, None) or kind.max == (1 << 32) - 1
    )


def is_shared(option: click.Parameter) -> bool:
    """Whether an option is one that commands share."""
    return not SHARED.isdisjoint(name.lstrip("-") for name in option.opts)


def heading(option: click.Parameter) -> str:
    """The heading that an option stands under."""
    if is_shared(option):
        return _SHARED
    group = option.group if isinstance(option, Option) else ""
    return f"Options for {group}" if group else _FIRST


def write(formatter: click.HelpFormatter, sections: Sections) -> None:
    """Write sections, their texts in one column; that of the short shared options is narrower."""
    names = [name for title, rows in sections.items() if title != _SHARED for name, _ in rows]
    column = min(max(map(len, names), default=0), _WIDEST)
    for title, rows in sections.items():
        width = 0 if title == _SHARED else column
        with formatter.section(title):
            formatter.write_dl([(name.ljust(width), text) for name, text in rows], _WIDEST)


def options_of(command: click.Command, ctx: click.Context) -> Sections:
    """The options of a command under their headings, those that commands share last."""
    sections: dict[str, list[tuple[str, str]]] = {_FIRST: []}
    options = [p for p in command.get_params(ctx) if isinstance(p, click.Option)]
    for option in sorted(options, key=is_shared):
        if record := option.get_help_record(ctx):
            sections.setdefault(heading(option), []).append(record)
    return {title: rows for title, rows in sections.items() if rows}
