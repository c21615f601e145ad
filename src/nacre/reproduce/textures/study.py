"""Codecs and what they make of textures: what is missing is made, the rest found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.reproduce.cache import Cache, cache_key, module_digest
from nacre.reproduce.textures import trial
from nacre.reproduce.textures.materials import Material
from nacre.reproduce.textures.methods import KINDS, Method, TrainingSettings
from nacre.reproduce.textures.sampling import ALL, Sampling
from nacre.reproduce.textures.trial import Errors
from nacre.runtime.progress import Progress, named, silent
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.codecs.codec_file import load_codec, save_codec
from nacre.textures.codecs.networks.preprocessing import Whitening
from nacre.textures.selection import random_texels

_WHITENING_TEXELS = 16
_DECIDING = (
    *("reproduce/textures/trial.py", "reproduce/textures/sampling.py"),
    *("measured/textures/domes.py", "textures/codecs/networks/preprocessing.py"),
    "textures/selection.py",
)
"""Modules that decide results, besides those of codecs."""


class _UnfitError(NacreError):
    """A codec that a texture cannot be given to."""


@dataclass
class Study:
    """Textures, and what methods make of them.

    Parameters
    ----------
    training, unseen
        Materials that codecs are made from, and others.
    others
        Further unseen ones, of any directions.
    again
        Second measurements of unseen ones, by the same names.
    settings
        Efforts.
    cache
        Where codecs and results are kept.
    texels
        Of each texture, at which errors are found; None for all.
    progress
        Called as the work goes on.
    """

    training: Sequence[Material]
    unseen: Sequence[Material]
    settings: TrainingSettings
    cache: Cache
    others: Sequence[Material] = ()
    again: Sequence[Material] = ()
    texels: int | None = None
    progress: Progress = silent
    skipped: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    """Materials that a method is not for, by method and reason."""
    _codecs: dict[tuple[str, int], TexelCodec] = field(default_factory=dict)

    def errors(
        self,
        method: Method,
        material: Material,
        sampling: Sampling = ALL,
        texels: int | None = None,
    ) -> Errors | None:
        """Errors of the texels of a material; None where the method is not for its directions.

        Parameters
        ----------
        method, material
            What is coded, and how.
        sampling
            From which pairs of directions.
        texels
            How many random texels are compared; the study's number where None.

        Raises
        ------
        FormatError
            If a texture cannot be read, or a result not written.
        NacreError
            If a codec cannot be made.
        """
        texels, seed = texels or self.texels, self.settings.seed
        report = named(self.progress, f"{method.name}, {material.name}")

        def make(texture: Btf, codec: TexelCodec) -> dict[str, Any]:
            return asdict(trial.errors(texture, codec, sampling, texels, seed, report))

        facts = ["errors", asdict(sampling), texels, seed]
        found = self._result(method, material, facts, ("squares", "logarithms"), make)
        return None if found is None else Errors(**found)

    def picture(
        self, method: Method, material: Material, pair: int, sampling: Sampling = ALL
    ) -> npt.NDArray[np.float32] | None:
        """The decoded texture at one pair of directions; see :meth:`errors`."""

        def make(texture: Btf, codec: TexelCodec) -> dict[str, Any]:
            return {"picture": trial.picture(texture, codec, sampling, pair, self.settings.seed)}

        facts = ["picture", asdict(sampling), pair, self.settings.seed]
        found = self._result(method, material, facts, ("picture",), make)
        return None if found is None else found["picture"]

    def rendering(
        self, material: Material, method: Method | None
    ) -> npt.NDArray[np.float32] | None:
        """A cylinder of the decoded texture, or of the measured one where no method is given.

        See :meth:`errors`, and :func:`nacre.reproduce.textures.trial.rendering`.
        """
        report = named(self.progress, f"{method.name if method else 'truth'}, {material.name}")

        def make(texture: Btf, codec: TexelCodec | None) -> dict[str, Any]:
            return {"rendering": trial.rendering(texture, codec, self.settings.seed, report)}

        def measured() -> dict[str, Any]:
            with material.opened() as texture:
                return make(texture, None)

        facts = ["rendering", self.settings.seed, module_digest("render/**/*.py")]
        names = ("rendering",)
        found = (
            self._kept([*facts, material.fingerprint, _code()], names, measured)
            if method is None
            else self._result(method, material, facts, names, make)
        )
        return None if found is None else found["rendering"]

    def codes(
        self, method: Method, material: Material, texels: int
    ) -> npt.NDArray[np.float32] | None:
        """Codes of random texels, shape (texels, code_dim); see :meth:`errors`."""

        def make(texture: Btf, codec: TexelCodec) -> dict[str, Any]:
            return {"codes": trial.codes(texture, codec, texels, self.settings.seed)}

        facts = ["codes", texels, self.settings.seed]
        found = self._result(method, material, facts, ("codes",), make)
        return None if found is None else found["codes"]

    def noise(self, material: Material, again: Material) -> float:
        """See :func:`nacre.reproduce.textures.trial.noise`.

        Raises
        ------
        NacreError
            If the two are not of the same size and directions.
        """

        def make() -> dict[str, Any]:
            with material.opened() as first, again.opened() as second:
                try:
                    return {"noise": np.array(trial.noise(first, second))}
                except ValueError as error:
                    raise NacreError(f"{again.path}: {error} as {material.path}") from error

        facts = ["noise", material.fingerprint, again.fingerprint, _code()]
        return float(self._kept(facts, ("noise",), make)["noise"])

    def deviation(self) -> float:
        """Standard deviation of logarithms in training, by which whitening divides them."""
        seed = self.settings.seed

        def make() -> dict[str, Any]:
            texels = (_some(material, seed) for material in self.training)
            return {"deviation": np.array(Whitening.of(texels).deviation)}

        facts = ["deviation", [material.fingerprint for material in self.training], seed, _code()]
        return float(self._kept(facts, ("deviation",), make)["deviation"])

    def left_out(self) -> list[tuple[str, str, list[str]]]:
        """Method, reason and materials of what was skipped, one entry a method and reason."""
        return [(*pair, materials) for pair, materials in sorted(self.skipped.items())]

    def codec(self, method: Method, material: Material) -> TexelCodec:
        """The codec of a method, for one material where it is of its own.

        Raises
        ------
        NacreError
            If it cannot be made, or has fewer values.
        """
        textures = self._textures(method, material)
        key = cache_key("codec", method.facts(textures, self.settings))
        if (key, method.code_dim) in self._codecs:
            return self._codecs[key, method.code_dim]
        name = f"{method.name} for {material.name}" if method.own else method.name
        report = named(self.progress, name)

        def make(state: Path) -> TexelCodec:
            return KINDS[method.kind].make(method, textures, self.settings, state, report)

        codec = self.cache.file(key, load_codec, make, save_codec)
        try:
            codec = codec.first(method.code_dim)
        except NacreError as error:
            raise _UnfitError(str(error)) from error
        self._codecs[key, method.code_dim] = codec
        return codec

    def _textures(self, method: Method, material: Material) -> Sequence[Material]:
        return [material] if method.own else self.training

    def _result(
        self,
        method: Method,
        material: Material,
        facts: Sequence[Any],
        names: Sequence[str],
        make: Callable[[Btf, TexelCodec], dict[str, Any]],
    ) -> Mapping[str, Any] | None:
        """Arrays of a codec and a texture; None where they do not fit."""
        made_from = method.facts(self._textures(method, material), self.settings)
        whole = [made_from, method.code_dim, material.fingerprint, *facts, _code()]

        def compute() -> dict[str, Any]:
            codec = self.codec(method, material)
            with material.opened() as texture:
                try:
                    return make(texture, codec)
                except FormatError:
                    raise
                except NacreError as error:
                    raise _UnfitError(str(error)) from error

        try:
            return self._kept(whole, names, compute)
        except _UnfitError as error:
            materials = self.skipped.setdefault((method.name, str(error)), [])
            if material.name not in materials:
                materials.append(material.name)
            return None

    def _kept(
        self, facts: Any, names: Sequence[str], make: Callable[[], dict[str, Any]]
    ) -> Mapping[str, Any]:
        """Arrays that were kept, or are made."""
        return self.cache.arrays(cache_key("result", facts), names, make)


def _some(material: Material, seed: int) -> Floats:
    """Values of a few texels."""
    with material.opened() as texture:
        chosen = random_texels(texture, _WHITENING_TEXELS, np.random.default_rng(seed))
        return texture.texels(chosen)


def _code() -> str:
    return module_digest(*_DECIDING)
