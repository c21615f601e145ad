"""Codecs and their results on textures, computed if they are not in the cache."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, is_dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.runtime.progress import Progress, named, silent
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.codecs.codec_file import load_codec, save_codec
from nacre.textures.codecs.networks.preprocessing import Whitening
from nacre.textures.selection import random_texels
from nacre_lab.reproduce.cache import Arrays, Cache, cache_key, module_digest
from nacre_lab.reproduce.textures import trial
from nacre_lab.reproduce.textures.materials import Material
from nacre_lab.reproduce.textures.methods import KINDS, Method, TrainingSettings, journal_path
from nacre_lab.reproduce.textures.rendering import SIZE, SOURCES, Rendering, View, rendering
from nacre_lab.reproduce.textures.sampling import ALL, Sampling
from nacre_lab.reproduce.textures.trainings import Training
from nacre_lab.reproduce.textures.trial import Errors

_WHITENING_TEXELS = 16
_DECIDING = (
    *("reproduce/textures/trial.py", "reproduce/textures/sampling.py"),
    *("measured/textures/domes.py", "textures/codecs/networks/preprocessing.py"),
    "textures/selection.py",
)
"""Modules that determine results, besides those of codecs."""


class _UnfitError(NacreError):
    """A codec that does not suit a texture."""


@dataclass
class Study:
    """Textures, and the results of methods on them.

    Parameters
    ----------
    training, unseen
        Materials for training codecs, and unseen ones.
    others
        More unseen ones, with any directions.
    again
        Second measurements of unseen ones, under the same names.
    texels
        Number of texels of each texture behind the errors; None for all.
    size
        Edge of renderings in pixels.
    height_fields
        Folder of height fields (NAME.exr) that the texels of unseen textures follow; None if they
        lie in a plane.
    """

    training: Sequence[Material]
    unseen: Sequence[Material]
    settings: TrainingSettings
    cache: Cache
    others: Sequence[Material] = ()
    again: Sequence[Material] = ()
    texels: int | None = None
    size: int = SIZE
    height_fields: Path | None = None
    progress: Progress = silent
    skipped: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    """Materials that a method does not suit, by method and reason."""
    _codecs: dict[tuple[str, int], TexelCodec] = field(default_factory=dict)

    def errors(
        self,
        method: Method,
        material: Material,
        sampling: Sampling = ALL,
        texels: int | None = None,
    ) -> Errors | None:
        """Errors of the texels of a material; None if the method is not for its directions.

        The number of random texels compared is given here or in the study.

        Raises
        ------
        FormatError
            If a texture cannot be read, or a result cannot be written.
        NacreError
            If a codec cannot be made.
        """
        make = partial(trial.errors, progress=self.report(method, material))
        found = self._result("errors", make, method, material, sampling, texels or self.texels)
        return None if found is None else Errors(*found)

    def picture(
        self, method: Method, material: Material, pair: int, sampling: Sampling = ALL
    ) -> Floats | None:
        """The decoded texture at one pair of directions; see :meth:`errors`."""
        return self._result("picture", trial.picture, method, material, sampling, pair)

    def rendering(self, material: Material, method: Method | None, view: View) -> Rendering | None:
        """An object with the decoded texture, or the measured one if no method is given.

        See :meth:`errors`, and :func:`nacre_lab.reproduce.textures.rendering.rendering`.
        """

        def make(texture: Btf, codec: TexelCodec | None, view: View, seed: int) -> Arrays:
            progress = self.report(method, material)
            return rendering(texture, codec, view, seed, progress)._asdict()

        names = Rendering._fields
        found = self.results("rendering", names, make, method, material, view, sources=SOURCES)
        return None if found is None else Rendering(found["picture"], float(found["seconds"]))

    def height_field(self, material: Material) -> Path | None:
        """The height field that the texels of a material follow, if any.

        Raises
        ------
        FormatError
            If the folder of height fields has none for it.
        """
        if self.height_fields is None:
            return None
        path = self.height_fields / f"{material.name}.exr"
        if not path.is_file():
            raise FormatError(f"{path}: does not exist; nacre btf capture --height-map writes it")
        return path

    def codes(self, method: Method, material: Material, texels: int) -> Floats | None:
        """Codes of random texels, shape (texels, code_dim); see :meth:`errors`."""
        return self._result("codes", trial.codes, method, material, texels)

    def noise(self, material: Material, again: Material) -> float:
        """See :func:`nacre_lab.reproduce.textures.trial.noise`.

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

        return float(self._kept("noise", [material.fingerprint, again.fingerprint], make))

    def deviation(self) -> float:
        """Standard deviation of the training logarithms, the divisor of whitening."""
        seed = self.settings.seed

        def make() -> Floats:
            texels = (_some(material, seed) for material in self.training)
            return np.array(Whitening.of(texels).deviation)

        facts = [[material.fingerprint for material in self.training], seed]
        return float(self._kept("deviation", facts, make))

    def training_of(self, method: Method, material: Material) -> Training | None:
        """The training of a method's codec; None if it is not a network."""
        codec = self.codec(method, material)
        if KINDS[method.kind].network is None:
            return None
        kept = self.cache.path(self._key(method, material), ".safetensors")
        directions = len(material.load().wi) if method.own else len(self.training[0].load().wi)
        return Training.of(method, codec, journal_path(kept), directions)

    def trainings(self, methods: Sequence[Method]) -> list[Training]:
        """The trainings of networks; for methods with one per material, of the first unseen one."""
        material = (*self.unseen, *self.others)[0]
        found = []
        for method in methods:
            with suppress(_UnfitError):
                found.append(self.training_of(method, material))
        return [training for training in found if training is not None]

    def timed(
        self,
        method: Method,
        material: Material,
        measure: Callable[[TexelCodec, Floats, Floats], float],
    ) -> float:
        """The cached result of a function of a codec at the directions of a material."""

        def make() -> Floats:
            texture = material.load()
            return np.array(measure(self.codec(method, material), texture.wi, texture.wo))

        facts = [self._key(method, material), method.code_dim, material.fingerprint]
        return float(self._kept(measure.__name__, facts, make))

    def left_out(self) -> list[tuple[str, str, list[str]]]:
        """Method, reason and materials of skipped trials, one entry per method and reason."""
        return [(*pair, materials) for pair, materials in sorted(self.skipped.items())]

    def codec(self, method: Method, material: Material) -> TexelCodec:
        """The codec of a method, for one material if each has its own.

        Raises
        ------
        NacreError
            If it cannot be made, or has fewer values.
        """
        textures = self._textures(method, material)
        key = self._key(method, material)
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

    def _key(self, method: Method, material: Material) -> str:
        """Name of the file for a codec."""
        return cache_key("codec", method.facts(self._textures(method, material), self.settings))

    def _textures(self, method: Method, material: Material) -> Sequence[Material]:
        return [material] if method.own else self.training

    def report(self, method: Method | None, material: Material) -> Progress:
        """The progress of one trial."""
        return named(self.progress, f"{method.name if method else 'truth'}, {material.name}")

    def _result(
        self,
        name: str,
        make: Callable[..., Floats | Errors],
        method: Method,
        material: Material,
        *arguments: Any,
    ) -> Floats | None:
        """The array made from a texture, a codec, arguments and the seed; see :meth:`results`."""
        found = self.results(
            name, (name,), lambda *given: {name: make(*given)}, method, material, *arguments
        )
        return None if found is None else found[name]

    def results(
        self,
        kind: str,
        names: Sequence[str],
        make: Callable[..., Arrays],
        method: Method | None,
        material: Material,
        *arguments: Any,
        sources: Sequence[str] = (),
    ) -> Arrays | None:
        """Arrays by name that a function makes from a texture, a codec, arguments and the seed.

        None if the method does not suit the texture; the codec is None without a method.
        `arguments` are JSON-able, dataclasses of such, or have `facts`; `sources` are modules that
        determine the results, besides those of codecs. `kind` names the cached results. See
        :meth:`errors` for what is raised.
        """
        seed = self.settings.seed
        facts = [material.fingerprint, *map(_facts, arguments), seed]
        if method is not None:
            made_from = method.facts(self._textures(method, material), self.settings)
            facts = [made_from, method.code_dim, *facts]

        def compute() -> Arrays:
            codec = None if method is None else self.codec(method, material)
            with material.opened() as texture:
                try:
                    return make(texture, codec, *arguments, seed)
                except FormatError:
                    raise
                except NacreError as error:
                    if method is None:
                        raise
                    raise _UnfitError(str(error)) from error

        try:
            return self._arrays(kind, names, facts, compute, sources)
        except _UnfitError as error:
            assert method is not None
            materials = self.skipped.setdefault((method.name, str(error)), [])
            if material.name not in materials:
                materials.append(material.name)
            return None

    def _kept(self, name: str, facts: Sequence[Any], make: Callable[[], Floats]) -> Floats:
        """An array from the cache, or a new one."""
        found: Floats = self._arrays(name, (name,), facts, lambda: {name: make()})[name]
        return found

    def _arrays(
        self,
        kind: str,
        names: Sequence[str],
        facts: Sequence[Any],
        make: Callable[[], Arrays],
        sources: Sequence[str] = (),
    ) -> Arrays:
        """Arrays from the cache, or new ones."""
        key = cache_key("result", [kind, *facts, module_digest(*_DECIDING, *sources)])
        return self.cache.arrays(key, names, make)


def _facts(argument: Any) -> Any:
    """What determines a result in an argument, JSON-able."""
    if isinstance(argument, View):
        return argument.facts()
    if is_dataclass(argument) and not isinstance(argument, type):
        return asdict(argument)
    return argument


def _some(material: Material, seed: int) -> Floats:
    """Values of a few texels."""
    with material.opened() as texture:
        chosen = random_texels(texture, _WHITENING_TEXELS, np.random.default_rng(seed))
        return texture.texels(chosen)
