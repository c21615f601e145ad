"""What every texture codec can do, and the registry of all of them.

A codec of another kind is one module with a subclass of :class:`TexelCodec` and one line in
:data:`CODECS`, or the entry point of another package; `docs/extending.md` has an example.
"""

from __future__ import annotations

import abc
import inspect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple, Self, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.io.files import PathLike
from nacre.io.tensors import Tensors
from nacre.objects.frozen import Frozen
from nacre.registry import Registry
from nacre.runtime.parallel import free_cores, thread_map
from nacre.runtime.progress import Progress, silent

TexelMap: TypeAlias = Callable[[Floats], Floats]

Chosen: TypeAlias = npt.NDArray[np.intp] | slice
"""Some of many pairs of directions."""

Filter: TypeAlias = Literal["reflectance", "codes"]

_PART = 64  # texels that one core takes at a time
_EMBEDDED_PAIRS = 512  # pairs of directions that texels are decoded at for distances between them


@dataclass(frozen=True, eq=False)
class LinearBlock:
    """Coefficients that measurements depend on linearly, and what these are like."""

    functions: Floats  # what multiplies the coefficients at pairs of directions, shape (n, k)
    variances: npt.NDArray[np.float64]  # prior ones of the coefficients, shape (k,)
    noise: float  # variance of a measurement about the sums
    channels: int = 1  # so many have coefficients of their own with these functions


class Coder(NamedTuple):
    """What encodes texels at pairs of directions, and decodes them at some of these."""

    encode: TexelMap
    decoder: Callable[[Chosen], TexelMap]


@dataclass(frozen=True)
class TrainingRun:
    """What a codec is trained on, and where it keeps what it has so far."""

    paths: Sequence[PathLike]  # files or folders of textures
    load: Callable[[PathLike], Btf]  # opens one
    state: Path | None = None
    """Start of the names of files that keep the training, so that a later run can resume it; they
    stay, for the caller to remove once the codec is saved."""
    fingerprint: str = ""  # what must be the same for that, besides the recipe
    journal: Path | None = None  # CSV file with the losses, for codecs that are `journaled`
    events: Path | None = None  # folder for TensorBoard, likewise
    progress: Progress = silent

    @property
    def textures(self) -> list[Callable[[], Btf]]:
        """Each opens a texture when called."""
        return [partial(self.load, path) for path in self.paths]


class TexelCodec(Frozen, abc.ABC):
    """Makes a code from a texel, at any directions, and reflectance from a code, at any others.

    What depends on the directions only is done once, then serves any number of texels. Subclasses
    say with class attributes what they can do; the defaults suit a codec that works at any
    directions.
    """

    kind: ClassVar[str]
    """Name in :data:`CODECS`, in files and for `nacre btf train --model`."""
    code_dim: int
    """Number of values of a code."""
    metadata: dict[str, Any]
    """JSON-able facts about the training."""
    uses_all_cores: ClassVar[bool] = False
    """Whether encoders and decoders share their work among the cores by themselves."""
    takes_half: ClassVar[bool] = False
    """Whether encoders take texels in half precision as well, and give codes that are not finite
    for values that are not."""
    encoded_together: ClassVar[int] = _PART
    """Texels that a core encodes at a time."""
    any_directions: ClassVar[bool] = True
    """Whether codes decode at any pairs of directions, not at the codec's own only."""
    hit_form: ClassVar[str] = ""
    """Form of the networks that a renderer can run at every hit, one of
    :data:`nacre.mitsuba.textures.decoders.HIT_DECODERS`; empty where there are none, so that
    textures are rendered from tables."""
    expanded_dim: int | None = None
    """Number of coefficients that a code can be expanded to once a texel, for hits; None if the
    codec has no such step."""
    filtered_by: ClassVar[Filter] = "reflectance"
    """What is averaged where a texture is seen from afar, unless a user chooses: what is closer to
    means of decoded reflectance; see :class:`nacre.textures.mipmap.LatentPyramid`."""
    distributed: ClassVar[bool] = False
    """Whether several processes that `torchrun` starts can train one together."""
    journaled: ClassVar[bool] = False
    """Whether its training writes the journal and the events of a :class:`TrainingRun`."""

    @abc.abstractmethod
    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """A function from texels known at n pairs of directions to their codes.

        It takes reflectance factors of shape (b, n, 3) and gives shape (b, :attr:`code_dim`). `wi`
        and `wo` are unit directions to the light and to the viewer, shape (n, 3). A NacreError says
        that the codec works at other directions only.
        """

    @abc.abstractmethod
    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """A function from codes, shape (b, :attr:`code_dim`), to reflectance factors (b, n, 3).

        `wi` and `wo` are unit directions, shape (n, 3). A NacreError says that the codec works at
        other directions only.
        """

    def coder(self, wi: Floats, wo: Floats) -> Coder:
        """The encoder, and decoders at some of its pairs of directions."""
        return Coder(self.encoder(wi, wo), lambda chosen: self.decoder(wi[chosen], wo[chosen]))

    def pack(self, precision: str | None = "single") -> tuple[dict[str, Any], Tensors]:
        """Header and tensors for a file; `metadata` is in the header.

        Weights have a precision among :data:`nacre.io.tensors.PRECISIONS`, or where None the lowest
        that changes no weight. A FormatError says that a weight is not finite or too large, or that
        codecs of this kind are not kept in files.
        """
        raise FormatError(f"a {type(self).__name__} cannot be kept in a file")

    @classmethod
    def unpack(cls, header: dict[str, Any], tensors: Tensors) -> TexelCodec:
        """The codec that :meth:`pack` packed.

        Raises a KeyError, TypeError, ValueError, AttributeError or OverflowError if a field is
        missing or bad.
        """
        raise ValueError(f"a {cls.__name__} cannot be kept in a file")

    def describe(self) -> dict[str, Any]:
        """Sizes of the codec's parts, JSON-able, in the order to print them."""
        return {}

    @classmethod
    def recipe(cls, *_: Any, **settings: Any) -> Any:
        """A dataclass of how to train, from the settings that a user chose.

        Subclasses that can be trained name the settings as keywords with defaults; `code_dim` and
        `seed` should be among them. A NacreError says that a setting is impossible.
        """
        raise NacreError(f"a codec of kind {cls.kind} cannot be trained")

    @classmethod
    def recipe_settings(cls) -> list[str]:
        """Names of the settings that :meth:`recipe` takes; none for a codec without training."""
        parameters = inspect.signature(cls.recipe).parameters.values()
        return [p.name for p in parameters if p.kind is p.KEYWORD_ONLY]

    @classmethod
    def train(cls, run: TrainingRun, recipe: Any) -> TexelCodec:
        """A codec learned from textures, by a recipe that :meth:`recipe` gave.

        Raises a FormatError if a texture cannot be read, and a NacreError if the textures do not
        suffice, or the state belongs to another training.
        """
        raise NacreError(f"a codec of kind {cls.kind} cannot be trained")

    @classmethod
    def state_files(cls, state: Path) -> list[Path]:
        """The files that a training with this :attr:`TrainingRun.state` keeps, as far as they
        exist.
        """
        return [state] if state.exists() else []

    def first(self, code_dim: int) -> Self:
        """The codec of the leading values of its codes.

        A NacreError says that codes have fewer values, or are not ordered by importance.
        """
        if code_dim != self.code_dim:
            raise NacreError(f"codes have {self.code_dim} values, expected {code_dim}")
        return self

    def embedding(self, wi: Floats, wo: Floats) -> TexelMap:
        """A function from codes (b, code_dim) to points (b, k) as far apart as texels look.

        The distance of two texels is the root of the mean squared difference of their square roots
        of reflectance, over the channels of all pairs of directions; here, of some pairs at random.
        The pairs `wi` and `wo` have shape (n, 3). A NacreError says that the codec decodes at other
        directions only.
        """
        count = min(_EMBEDDED_PAIRS, len(wi))
        chosen = np.random.default_rng(0).choice(len(wi), count, replace=False)
        decode = on_all_cores(self, self.decoder(wi[chosen], wo[chosen]))
        scale = np.float32((3 * count) ** -0.5)

        def roots(codes: Floats) -> Floats:
            found: Floats = np.sqrt(np.maximum(decode(codes), 0.0)).reshape(len(codes), -1)
            return scale * found

        return roots

    def expanded(self) -> TexelCodec | None:
        """The codec whose codes are the :attr:`expanded_dim` coefficients of this one's codes, and
        say more about a texel; None where there are none.
        """
        return None

    def coefficients(self, codes: Floats) -> Floats:
        """What codes, shape (b, :attr:`code_dim`), are expanded to: (b, :attr:`expanded_dim`)."""
        raise NotImplementedError

    def shortened(self, coefficients: Floats) -> Floats:
        """Codes closest to coefficients, shape (b, :attr:`expanded_dim`)."""
        raise NotImplementedError

    def linear_blocks(self, wi: Floats, wo: Floats) -> list[LinearBlock]:
        """What measurements at pairs of directions, shape (n, 3), say about coefficients.

        Directions to photograph are chosen by it, see :func:`nacre.textures.plan.informative`. A
        NacreError says that the codec has no linear model.
        """
        raise NacreError(
            f"plans are for codecs with a linear model, like basis; this one is {self.kind}"
        )


CODECS: Registry[type[TexelCodec]] = Registry(
    "nacre.codecs",
    "kind of texture codec",
    {
        "basis": "nacre.textures.codecs.basis.codec:BasisCodec",
        "unified": "nacre.textures.codecs.networks.unified:UnifiedNetwork",
        "custom": "nacre.textures.codecs.networks.custom:CustomNetwork",
        "pca": "nacre.textures.codecs.principal.codec:PcaCodec",
    },
)
"""All kinds of texture codecs, the default one first."""


def check_shape(what: str, array: Floats, *expected: int) -> None:
    """Refuse an array of another shape than (b, expected...)."""
    if array.shape[1:] != expected:
        raise ValueError(f"{what} are {array.shape}, expected (b, {', '.join(map(str, expected))})")


def on_all_cores(codec: TexelCodec, run: TexelMap, size: int = _PART) -> TexelMap:
    """The same encoder or decoder of a codec, with texels shared among the cores.

    A core takes `size` of them at a time. A thread that is one of many
    (:func:`nacre.runtime.parallel.one_of_many`) does them itself.

    Numbers that overflow give no warning: results tell.
    """
    if codec.uses_all_cores:
        return run

    def quiet(texels: Floats) -> Floats:
        with np.errstate(over="ignore", invalid="ignore"):
            return run(texels)

    def shared(texels: Floats) -> Floats:
        if len(texels) <= size:
            return quiet(texels)
        starts = range(0, len(texels), size)
        spread: Callable[..., Iterator[Floats]] = thread_map if free_cores() > 1 else map
        parts = spread(lambda start: quiet(texels[start : start + size]), starts)
        first = next(parts)
        result: Floats = np.empty((len(texels), *first.shape[1:]), first.dtype)
        for start, part in zip(starts, chain([first], parts), strict=True):
            result[start : start + size] = part
        return result

    return shared
