"""The command grammar: types of arguments, and options that several commands share."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from nacre.cli.layout import SUBJECTS, Option
from nacre.cli.ranges import SEED, FiniteRange, IntRange
from nacre.cli.session import session
from nacre.errors import did_you_mean
from nacre.included import names as included_names
from nacre.included import resolve
from nacre.io.files import check_not_inputs, check_writable

if TYPE_CHECKING:
    ParamType: TypeAlias = click.ParamType[Any]  # generic for type checkers of late
else:
    ParamType = click.ParamType


class Choice(click.Choice[str]):
    """One of a few words."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value not in self.choices:
            problem = f"{value!r} is not one of {', '.join(self.choices)}"
            self.fail(problem + did_you_mean(str(value), self.choices), param, ctx)
        return super().convert(value, param, ctx)


class Input(click.Path):
    """A file or folder to read, the name of an included material, or - for standard input."""

    def others(self) -> Iterable[str]:
        """Names that may stand in place of a file, but for those of included materials."""
        return ()

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "-":
            return session().spooled()
        return super().convert(resolve(value), param, ctx)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """See click; after a colon, complete the names of included materials."""
        found = [
            name for name in included_names() if ":" in incomplete and name.startswith(incomplete)
        ]
        return [*map(CompletionItem, found)] or super().shell_complete(ctx, param, incomplete)


class _Codec(Input):
    """A codec file, or the name of an included codec."""

    def others(self) -> Iterable[str]:
        from nacre.textures.codecs.codec_file import PRETRAINED

        return PRETRAINED

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        from nacre.textures.codecs.codec_file import PRETRAINED

        return PRETRAINED.get(value) or super().convert(value, param, ctx)


class Output(click.Path):
    """A file to write; - is standard output if the command writes text, with the ending `text`."""

    def __init__(self, text: str = "") -> None:
        super().__init__(path_type=Path)
        self._text = text

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value != "-":
            return super().convert(value, param, ctx)
        if not self._text:
            self.fail("-: binary files cannot go to standard output; name a file", param, ctx)
        return session().to_stdout(self._text)


class Parsed(ParamType):
    """Text that a function parses; its ValueError says what was expected."""

    def __init__(self, name: str, parse: Callable[[str], Any]) -> None:
        self.name, self._parse = name, parse

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            return self._parse(value) if isinstance(value, str) else value
        except ValueError as error:
            self.fail(str(error), param, ctx)


def _texels(text: str) -> tuple[int, int]:
    """Width and height in texels, such as 64x48; a single number stands for both."""
    parts = text.lower().split("x")
    if len(parts) > 2 or not all(p.isascii() and p.isdigit() and len(p) < 6 for p in parts):
        raise ValueError(f"{text!r}: expected a width and a height, like 64x48")
    width, height = int(parts[0]), int(parts[-1])
    if not 1 <= min(width, height) <= max(width, height) <= 1 << 14:
        raise ValueError(f"{text}: expected 1 to {1 << 14} texels each way")
    return width, height


def integers(example: str, count: int | None = None, most: int | None = None) -> Parsed:
    """Whole numbers separated by commas: `count` of them, or up to eight if it is None.

    Messages show the `example`. With `most`, the numbers are widths from 1 to `most`.
    """

    def parse(text: str) -> tuple[int, ...]:
        parts = text.split(",")
        whole = all(len(p) < 10 and p.isascii() and p.isdigit() for p in parts)
        if not whole or len(parts) > 8 or count not in (None, len(parts)):
            raise ValueError(f"expected whole numbers separated by commas, like {example}")
        if most and not all(1 <= int(part) <= most for part in parts):
            raise ValueError(f"expected up to 8 widths from 1 to {most}, like {example}")
        return tuple(map(int, parts))

    return Parsed("N,N", parse)


def floats(text: str) -> tuple[float, ...]:
    """Numbers separated by commas; NaN alone if the text is something else."""
    try:
        return tuple(map(float, text.split(",")))
    except ValueError:
        return (math.nan,)


def _direction(text: str) -> tuple[float, ...]:
    angles = floats(text)
    if len(angles) != 2 or not (0.0 <= angles[0] < 90.0 and math.isfinite(angles[1])):
        raise ValueError("expected a polar angle below 90 and an azimuth, like 30,180")
    return angles


INPUT, OUTPUT, TEXT = Input(path_type=Path), Output(), click.STRING
TEXELS, DIRECTION = Parsed("WxH", _texels), Parsed("THETA,PHI", _direction)
TEXEL = integers("12,7", 2)


def option(names: str, kind: ParamType | Sequence[str] | None = None, **settings: Any) -> Option:
    """An option of a command.

    Parameters
    ----------
    names
        As click takes them, separated by spaces: "--size", "-o --output", "--decode decoder".
    kind
        Type of its values, or the values to choose from.
    settings
        As :class:`nacre.cli.layout.Option` takes them: `group` says what it is about. The help
        may follow as text; see :func:`nacre.cli.command.command`.
    """
    chosen = kind if kind is None or isinstance(kind, click.ParamType) else Choice(kind)
    return Option(names.split(), type=chosen, **settings)


def names(_context: click.Context, _parameter: click.Parameter, value: str | None) -> list[str]:
    """Callback of an option: distinct names separated by commas, in order."""
    return list(dict.fromkeys(part.strip() for part in (value or "").split(",") if part.strip()))


def refuse(applies: Container[str], subject: str) -> None:
    """Raise a UsageError if an option is given that is limited to one of the kinds `applies`.

    `subject` says why that is wrong: "gold.bsdf is a reflectance".
    """
    for option, flag in given():
        if option.applies in applies:
            raise click.UsageError(f"{flag} is for {SUBJECTS[option.applies]}; {subject}")


def given() -> Iterator[tuple[Option, str]]:
    """The options on the command line, each with its flag."""
    for option in click.get_current_context().command.params:
        if isinstance(option, Option) and is_given(option.name or ""):
            yield option, max(option.opts, key=len)


def is_given(name: str) -> bool:
    source = click.get_current_context().get_parameter_source(name)
    return source == ParameterSource.COMMANDLINE


def check_outputs(
    outputs: Iterable[Path | None], inputs: Iterable[Path | None], internal: Iterable[Path] = ()
) -> None:
    """Raise before the work if an output could not be written after it, or is an input.

    Paths that are None are skipped; `internal` are states and caches, which must not be inputs.

    Raises
    ------
    FormatError
        If a folder is absent or not writable, or an output is a folder or an input.
    """
    from nacre.cli.report import detail

    read, written = ([path for path in paths if path] for paths in (inputs, outputs))
    check_not_inputs([*written, *internal], read)
    for path in written:
        check_writable(path)
    for verb, paths in (("reads", read), ("writes", written)):
        for path in paths:
            detail(f"{verb} {path.resolve()}")


def argument(name: str, kind: ParamType | None = INPUT, **settings: Any) -> click.Argument:
    """An argument of a command: a file or folder to read unless `kind` is another."""
    return click.Argument([name], type=kind, **settings)


def inputs_argument(name: str = "paths", metavar: str = "INPUT...") -> click.Argument:
    return argument(name, nargs=-1, required=True, metavar=metavar)


def output_option(
    about: str = "", *, required: bool = True, text: str = "", **settings: Any
) -> Option:
    """Option for the file that a command writes; `text` as for standard output."""
    return option("-o --output", Output(text), required=required, help=about, **settings)


def _shared(names: str, kind: Any = None, **defaults: Any) -> Callable[..., Option]:
    """An option that several commands share, each with its own changes to the settings."""
    return lambda kind=kind, **settings: option(names, kind, **(defaults | settings))


seed_option = _shared("--seed", SEED, default=0, help="Random seed.")
jobs_option = _shared(
    "--jobs",
    IntRange(1),
    shown="one per core",
    help="Number of materials fitted at the same time.",
)
environment_option = _shared(
    "--environment",
    INPUT,
    shown="a built-in studio",
    help="Latitude-longitude map to light with (.exr, .hdr, .png).",
)
resolution_option = _shared(
    "--resolution",
    integers("90,90,180"),
    metavar="N,N,...",
    shown="see docs/reference/formats.md",
    help="Nodes per axis of a table: theta_h,theta_d,phi_d for .binary and .npz; "
    "phi_i,theta_i,square,azimuths,polars for .bsdf; theta,phi for .mbsdf.",
)
preset_option = _shared(
    "--preset",
    ["draft", "standard", "best"],
    default="standard",
    help="Length of the fit: about 0.3, 1.5 or 12 seconds for an isotropic material on two idle "
    "server cores. The first fit on a machine compiles for about 5 seconds more.",
)
scale_option = _shared(
    "--free-scale",
    is_flag=True,
    help="Also find one factor for all samples, as from an uncalibrated instrument.",
)
basis_option = _shared(
    "--basis basis_name",
    metavar="neural|hypernetwork|FILE",
    default="neural",
    help="Latent basis: included, or from nacre latent train.",
)
codec_option = _shared(
    "--codec",
    _Codec(path_type=Path),
    metavar="basis|unified|FILE",
    shown="basis",
    help="Texture codec: nacre's own, that of Rainer et al. 2020, or one from nacre btf train.",
)
precision_option = _shared("--precision", ["single", "half"])
pixels_option = _shared(
    "--pixels",
    ["reflectance", "radiance"],
    shown="from the list of directions, else reflectance",
    help="Values in a folder of images: reflectance relative to white, or radiance under unit "
    "irradiance, with the light's cosine.",
)
directions_option = _shared(
    "--directions",
    metavar="bonn|utia|FILE",
    help="Directions: all pairs of a dome, or a list (.csv).",
)
bytes_per_texel_option = _shared(
    "--bytes-per-texel",
    FiniteRange(0.5, 64.0),
    metavar="B",
    help="Size of the codes.",
)
quality_option = _shared(
    "--quality",
    FiniteRange(10.0, 80.0),
    metavar="DB",
    help="Loss of the codes: 25 is coarse, 40 fine.",
)
texels_option = _shared("--texels", TEXELS, metavar="WxH")
device_option = _shared(
    "--device",
    metavar="NAME",
    help="PyTorch device, such as cpu or cuda:1, instead of the CPU kernel.",
)
height_field_option = _shared("--height-field", INPUT, applies="btf")
depth_option = _shared(
    "--depth",
    FiniteRange(0.0),
    applies="btf",
    shown="0.1; 1 for .exr",
    help="Depth of the height field from black to white, in widths of the texture.",
)
picture_size_option = _shared(
    "--size", IntRange(16, 1024), default=192, help="Width of each picture in pixels."
)
spp_option = _shared(
    "--spp", IntRange(1), shown="as in nacre render, denoised", help="Samples per pixel."
)
