"""The grammar in one place: types of arguments, and options that several commands share."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import click
from click.core import ParameterSource

from nacre.cli.session import session
from nacre.errors import FormatError
from nacre.io.files import check_writable

if TYPE_CHECKING:
    ParamType: TypeAlias = click.ParamType[Any]  # generic for type checkers of late
else:
    ParamType = click.ParamType

_Function = TypeVar("_Function", bound=Callable[..., Any])

SEED = click.IntRange(0, (1 << 32) - 1)
"""Seeds; of the libraries that draw numbers, some take 32 bits."""


class FiniteRange(click.FloatRange):
    """Finite numbers in a range: to click "nan" lies within all, "inf" in open ones."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """See click."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


class _Input(click.Path):
    """A file or folder to read, which the command checks itself; - is standard input."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """See click."""
        return session().spooled() if value == "-" else super().convert(value, param, ctx)


class Output(click.Path):
    """A file to write, which the command checks itself.

    Parameters
    ----------
    text
        Ending of what - stands for, standard output, where text is written; else - is refused.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(path_type=Path)
        self._text = text

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """See click."""
        if value != "-":
            return super().convert(value, param, ctx)
        if not self._text:
            self.fail("-: standard output takes no binary file; name a file", param, ctx)
        return session().to_stdout(self._text)


class _Texels(ParamType):
    """Width and height in texels, like 64x48; a lone number is both."""

    name = "WxH"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        """See click."""
        if isinstance(value, tuple):
            return value
        parts = str(value).lower().split("x")
        if len(parts) > 2 or not all(p.isascii() and p.isdigit() and len(p) < 6 for p in parts):
            self.fail(f"{value!r}: expected a width and a height, like 64x48", param, ctx)
        width, height = int(parts[0]), int(parts[-1])
        if not 1 <= min(width, height) <= max(width, height) <= 1 << 14:
            self.fail(f"{value}: expected 1 to {1 << 14} texels each way", param, ctx)
        return width, height


class Integers(ParamType):
    """Whole numbers with commas between them.

    Parameters
    ----------
    example
        For messages.
    count
        How many there must be; up to eight where None.
    """

    name = "N,N"

    def __init__(self, example: str, count: int | None = None) -> None:
        self._example, self._count = example, count

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, ...]:
        """See click."""
        if isinstance(value, tuple):
            return value
        parts = str(value).split(",")
        whole = all(len(p) < 10 and p.isascii() and p.isdigit() for p in parts)
        if not whole or len(parts) > 8 or self._count not in (None, len(parts)):
            text = f"expected whole numbers with commas between them, like {self._example}"
            self.fail(text, param, ctx)
        return tuple(map(int, parts))


class _Direction(ParamType):
    """A polar angle and an azimuth in degrees."""

    name = "THETA,PHI"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        """See click."""
        if isinstance(value, tuple):
            return value
        try:
            theta, phi = (float(part) for part in str(value).split(","))
        except ValueError:
            theta, phi = math.nan, math.nan
        if not (0.0 <= theta < 90.0 and math.isfinite(phi)):
            self.fail("expected a polar angle below 90 and an azimuth, like 30,180", param, ctx)
        return theta, phi


INPUT, OUTPUT, TEXELS, DIRECTION = _Input(), Output(), _Texels(), _Direction()

_SUBJECTS = {
    "brdf": "reflectances (BRDFs)",
    "btf": "textures (BTFs)",
    "network": "networks",
    "network codec": "unified and custom",
}
"""What options may be for where that is not everything."""


class _Option(click.Option):
    """An option that may be for one kind of material or model only; see :func:`refuse`."""

    def __init__(self, *arguments: Any, applies: str = "", **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        self.applies = applies
        if self.metavar is None and isinstance(self.type, click.IntRange | click.FloatRange):
            self.metavar = "N" if isinstance(self.type, click.IntRange) else "X"

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """See click; a default in words stands there without brackets, after what it is for."""
        record = super().get_help_record(ctx)
        if record is None:
            return record
        names, text = record
        if isinstance(self.show_default, str):
            text = text.replace(f"({self.show_default})", self.show_default)
        if self.applies:
            about, bracket, extra = text.rpartition("  [")
            only = f"{_SUBJECTS[self.applies]} only"
            text = f"{about}  [{only}; {extra}" if bracket else f"{text}  [{only}]"
        return names, text


def option(*names: str, applies: str = "", **settings: Any) -> Callable[[_Function], _Function]:
    """An option; `applies` names what it is for where that is not everything."""
    return click.option(*names, cls=_Option, applies=applies, **settings)


def refuse(applies: Container[str], subject: str) -> None:
    """Refuse options on the command line that are for something else than the subject.

    Parameters
    ----------
    applies
        What options are for that must not be given.
    subject
        What is at hand: "gold.bsdf is a reflectance".

    Raises
    ------
    UsageError
        Naming the first such option.
    """
    context = click.get_current_context()
    for parameter in context.command.params:
        if isinstance(parameter, _Option) and parameter.applies in applies:
            name = max(parameter.opts, key=len)
            if is_given(parameter.name or ""):
                subjects = _SUBJECTS[parameter.applies]
                raise click.UsageError(f"{name} is for {subjects}; {subject}", context)


def is_given(name: str) -> bool:
    """Whether a parameter was given on the command line."""
    source = click.get_current_context().get_parameter_source(name)
    return source == ParameterSource.COMMANDLINE


def check_outputs(
    outputs: Iterable[Path], inputs: Iterable[Path], internal: Iterable[Path] = ()
) -> None:
    """Raise before work starts if a file could not be written at its end, or is an input.

    Parameters
    ----------
    outputs
        Files to write.
    inputs
        Files that are read.
    internal
        States and caches, which may be there but must not be inputs.

    Raises
    ------
    FormatError
        If a folder is absent or not writable, or an output is a folder or an input.
    """
    from nacre.cli.report import detail

    inputs, outputs = list(inputs), list(outputs)
    taken = {path.resolve() for path in inputs}
    for path in (*outputs, *internal):
        if path.resolve() in taken:
            raise FormatError(f"{path}: is the input as well; name another output")
    for path in outputs:
        check_writable(path)
    for verb, paths in (("reads", inputs), ("writes", outputs)):
        for path in paths:
            detail(f"{verb} {path.resolve()}")


def input_argument(name: str = "path", **settings: Any) -> Callable[[_Function], _Function]:
    """One file or folder to read."""
    return click.argument(name, type=INPUT, **settings)


def inputs_argument(name: str = "paths", **settings: Any) -> Callable[[_Function], _Function]:
    """Files or folders to read, one or more."""
    return click.argument(name, nargs=-1, required=True, type=INPUT, **settings)


def output_option(
    about: str, *, required: bool = True, text: str = "", **settings: Any
) -> Callable[[_Function], _Function]:
    """The file that a command writes."""
    kind = Output(text)
    return option("-o", "--output", required=required, type=kind, help=about, **settings)


def _shared(*names: str, **defaults: Any) -> Callable[..., Callable[[_Function], _Function]]:
    """An option of several commands, which may change its settings."""
    return lambda **settings: option(*names, **{**defaults, **settings})


seed_option = _shared(
    "--seed",
    type=SEED,
    default=0,
    help="Seed of all random numbers: the same seed gives the same result.",
)
jobs_option = _shared(
    "--jobs", type=click.IntRange(1), show_default="one a core", help="Materials at a time."
)
environment_option = _shared(
    "--environment",
    type=INPUT,
    show_default="a built-in studio",
    help="Light from a latitude-longitude map (.exr, .hdr, .png).",
)
material_option = _shared("--material", help="Name of the material, for a file of several.")
resolution_option = _shared(
    "--resolution",
    type=Integers("90,90,180"),
    metavar="N,N,...",
    show_default="see docs/reference/formats.md",
    help="Nodes of a table: theta_h,theta_d,phi_d for .binary and .npz; "
    "phi_i,theta_i,square,azimuths,polars for .bsdf.",
)
preset_option = _shared(
    "--preset",
    default="standard",
    type=click.Choice(["draft", "standard", "best"]),
    help="Length of the fit: about 0.5, 3 or 15 seconds on two cores.",
)
basis_option = _shared(
    "--basis",
    "basis_name",
    metavar="neural|hypernetwork|FILE",
    default="neural",
    help="Latent basis: a pretrained one that is included, or a file of nacre latent train.",
)
codec_option = _shared(
    "--codec",
    type=INPUT,
    show_default="the pretrained one that is included",
    help="Texture codec, a file of nacre btf train.",
)
precision_option = _shared("--precision", type=click.Choice(["single", "half"]))
pixels_option = _shared(
    "--pixels",
    type=click.Choice(["reflectance", "radiance"]),
    show_default="what the list of directions says, else reflectance",
    help="Meaning of pixels in a folder of images: reflectance factors, relative to white under "
    "the same light, or radiance for unit irradiance, which includes the cosine of the light.",
)
directions_option = _shared(
    "--directions",
    metavar="bonn|utia|FILE",
    help="Pairs of directions: every light with every view of a dome, or a list (.csv).",
)
texels_option = _shared("--texels", type=TEXELS)
device_option = _shared(
    "--device", help="PyTorch device, like cpu, cuda or cuda:1, in place of the CPU kernel."
)
