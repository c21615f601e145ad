"""Codecs and what they make of textures: what is missing is made, the rest found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.io.files import atomic_path
from nacre.reproduce.cache import DAMAGED, SOURCES, facts_digest, sources_digest
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
    *("reproduce/btf/trial.py", "reproduce/btf/sampling.py", "btf/domes.py"),
    *("btf/networks/preprocessing.py", "btf/selection.py"),
)


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
    folder
        Where codecs and results are kept; made if it is not there.
    texels
        Of each texture, at which errors are found; None for all.
    fresh
        Whether to make again what is kept there.
    progress
        Called as the work goes on.
    """

    training: Sequence[Material]
    unseen: Sequence[Material]
    settings: TrainingSettings
    folder: Path
    others: Sequence[Material] = ()
    again: Sequence[Material] = ()
    texels: int | None = None
    fresh: bool = False
    progress: Progress = silent
    skipped: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    """Materials that a method is not for, by method and reason."""
    _codecs: dict[tuple[str, int], TexelCodec] = field(default_factory=dict)
    _made: set[Path] = field(default_factory=set)

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

        facts = ["rendering", self.settings.seed, sources_digest(SOURCES.glob("render/**/*.py"))]
        names = ("rendering",)
        found = (
            self._kept([*facts, material.mark, _code()], names, measured)
            if method is None
            else self._result(method, material, facts, names, make)
        )
        return None if found is None else found["rendering"]

    def codes(
        self, method: Method, material: Material, texels: int
    ) -> npt.NDArray[np.float32] | None:
        """Codes of random texels, shape (texels, values); see :meth:`errors`."""

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

        facts = ["noise", material.mark, again.mark, _code()]
        return float(self._kept(facts, ("noise",), make)["noise"])

    def deviation(self) -> float:
        """Standard deviation of logarithms in training, by which whitening divides them."""
        seed = self.settings.seed

        def make() -> dict[str, Any]:
            texels = (_some(material, seed) for material in self.training)
            return {"deviation": np.array(Whitening.of(texels).deviation)}

        facts = ["deviation", [material.mark for material in self.training], seed, _code()]
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
        mark = facts_digest(method.facts(textures, self.settings))
        if (mark, method.values) in self._codecs:
            return self._codecs[mark, method.values]
        kind = KINDS[method.kind]
        path = self.folder / f"codec-{mark}.safetensors"
        codec = None
        if path.is_file() and not self._again(path):
            try:
                codec = load_codec(path)
            except NacreError:
                path.unlink()
        if codec is None:
            self.folder.mkdir(parents=True, exist_ok=True)
            state = path.with_suffix(".state")
            name = f"{method.name} for {material.name}" if method.own else method.name
            report = named(self.progress, name)
            codec = kind.make(method, textures, self.settings, state, report)
            save_codec(codec, path)
            self._made.add(path)
            for left in self.folder.glob(f"{state.name}*"):
                left.unlink()
        try:
            codec = codec.first(method.values)
        except NacreError as error:
            raise _UnfitError(str(error)) from error
        self._codecs[mark, method.values] = codec
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
    ) -> dict[str, Any] | None:
        """Arrays of a codec and a texture; None where they do not fit."""
        made_from = method.facts(self._textures(method, material), self.settings)
        whole = [made_from, method.values, material.mark, *facts, _code()]

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
    ) -> dict[str, Any]:
        """Arrays in a file, which is written where it is not there."""
        path = self.folder / f"result-{facts_digest(facts)}.npz"
        if not self._again(path):
            try:
                with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                    return {name: arrays[name] for name in names}
            except DAMAGED:
                pass
        made = make()
        self.folder.mkdir(parents=True, exist_ok=True)
        with atomic_path(path, internal=True) as temporary:
            np.savez_compressed(temporary, **made)
        self._made.add(path)
        return made

    def _again(self, path: Path) -> bool:
        """Whether to make a file again although it may be there."""
        return self.fresh and path not in self._made


def _some(material: Material, seed: int) -> Floats:
    """Values of a few texels."""
    with material.opened() as texture:
        chosen = random_texels(texture, _WHITENING_TEXELS, np.random.default_rng(seed))
        return texture.texels(chosen)


def _code() -> str:
    """Of the modules that decide results, besides those of codecs."""
    return sources_digest(SOURCES / module for module in _DECIDING)
