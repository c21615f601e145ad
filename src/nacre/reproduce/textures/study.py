"""Codecs and what they make of textures: what is missing is made, the rest found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.reproduce.cache import Cache, cache_key, module_digest
from nacre.reproduce.textures import trial
from nacre.reproduce.textures.materials import Material
from nacre.reproduce.textures.methods import Method, TrainingSettings
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
    texels
        Of each texture, at which errors are found; None for all.
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

        As many random texels are compared as is said here, or in the study.

        Raises
        ------
        FormatError
            If a texture cannot be read, or a result not written.
        NacreError
            If a codec cannot be made.
        """
        texels, seed = texels or self.texels, self.settings.seed
        report = named(self.progress, f"{method.name}, {material.name}")

        def make(texture: Btf, codec: TexelCodec) -> Floats:
            found = trial.errors(texture, codec, sampling, texels, seed, report)
            return np.stack([found.squares, found.logarithms])

        facts = ["errors", asdict(sampling), texels, seed]
        found = self._result(method, material, facts, make)
        return None if found is None else Errors(*found)

    def picture(
        self, method: Method, material: Material, pair: int, sampling: Sampling = ALL
    ) -> Floats | None:
        """The decoded texture at one pair of directions; see :meth:`errors`."""
        seed = self.settings.seed
        return self._result(
            method,
            material,
            ["picture", asdict(sampling), pair, seed],
            lambda texture, codec: trial.picture(texture, codec, sampling, pair, seed),
        )

    def rendering(self, material: Material, method: Method | None) -> Floats | None:
        """A cylinder of the decoded texture, or of the measured one where no method is given.

        See :meth:`errors`, and :func:`nacre.reproduce.textures.trial.rendering`.
        """
        seed = self.settings.seed
        report = named(self.progress, f"{method.name if method else 'truth'}, {material.name}")

        def make(texture: Btf, codec: TexelCodec | None = None) -> Floats:
            return trial.rendering(texture, codec, seed, report)

        def measured() -> Floats:
            with material.opened() as texture:
                return make(texture)

        facts = ["rendering", seed, module_digest("render/**/*.py")]
        if method is None:
            return self._kept("rendering", [*facts, material.fingerprint], measured)
        return self._result(method, material, facts, make)

    def codes(self, method: Method, material: Material, texels: int) -> Floats | None:
        """Codes of random texels, shape (texels, code_dim); see :meth:`errors`."""
        seed = self.settings.seed
        return self._result(
            method,
            material,
            ["codes", texels, seed],
            lambda texture, codec: trial.codes(texture, codec, texels, seed),
        )

    def noise(self, material: Material, again: Material) -> float:
        """See :func:`nacre.reproduce.textures.trial.noise`.

        Raises
        ------
        NacreError
            If the two are not of the same size and directions.
        """

        def make() -> Floats:
            with material.opened() as first, again.opened() as second:
                try:
                    return np.array(trial.noise(first, second))
                except ValueError as error:
                    raise NacreError(f"{again.path}: {error} as {material.path}") from error

        return float(self._kept("noise", ["noise", material.fingerprint, again.fingerprint], make))

    def deviation(self) -> float:
        """Standard deviation of logarithms in training, by which whitening divides them."""
        seed = self.settings.seed

        def make() -> Floats:
            texels = (_some(material, seed) for material in self.training)
            return np.array(Whitening.of(texels).deviation)

        facts = ["deviation", [material.fingerprint for material in self.training], seed]
        return float(self._kept("deviation", facts, make))

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
            return method.train(textures, self.settings, state, report)

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
        make: Callable[[Btf, TexelCodec], Floats],
    ) -> Floats | None:
        """What comes of a codec and a texture; None where they do not fit."""
        made_from = method.facts(self._textures(method, material), self.settings)

        def compute() -> Floats:
            codec = self.codec(method, material)
            with material.opened() as texture:
                try:
                    return make(texture, codec)
                except FormatError:
                    raise
                except NacreError as error:
                    raise _UnfitError(str(error)) from error

        try:
            whole = [made_from, method.code_dim, material.fingerprint, *facts]
            return self._kept(facts[0], whole, compute)
        except _UnfitError as error:
            materials = self.skipped.setdefault((method.name, str(error)), [])
            if material.name not in materials:
                materials.append(material.name)
            return None

    def _kept(self, name: str, facts: Sequence[Any], make: Callable[[], Floats]) -> Floats:
        """An array that was kept, or is made."""
        key = cache_key("result", [*facts, module_digest(*_DECIDING)])
        found: Floats = self.cache.arrays(key, (name,), lambda: {name: make()})[name]
        return found


def _some(material: Material, seed: int) -> Floats:
    """Values of a few texels."""
    with material.opened() as texture:
        chosen = random_texels(texture, _WHITENING_TEXELS, np.random.default_rng(seed))
        return texture.texels(chosen)
