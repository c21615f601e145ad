"""Bases that have not seen the materials whose lobes they predict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.io.files import digest
from nacre.latent.basis import LatentBasis
from nacre.latent.file import PRETRAINED, find_basis
from nacre.latent.predicting import PredictingBasis
from nacre.runtime.progress import Progress, named
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.codes import HELD_OUT, MIN_MATERIALS, CodeSettings, bases

_FOLDS = round(1.0 / HELD_OUT)
_SAME = "-rgb", "-spec"
"""Endings of names of files that hold the same material."""


class TooFewError(NacreError):
    """Too few materials to train, for each, a basis that has not seen it."""


@dataclass(frozen=True)
class UnseenBases:
    """For each material, a basis of one kind that has not seen it.

    Parameters
    ----------
    by_hash
        By the SHA-256 of the materials' files.
    about
        What the bases were trained on, as text.
    """

    by_hash: Mapping[str, PredictingBasis]
    about: str

    def of(self, brdf: Brdf) -> PredictingBasis:
        """The basis for a material read from a file."""
        return self.by_hash[(brdf.source or {})["sha256"]]

    def fingerprint(self) -> str:
        """Fingerprint of these bases, including their predictors."""
        found = {basis.fingerprint(predictors=True) for basis in self.by_hash.values()}
        return " ".join(sorted(found))


def separate(files: Sequence[Path], unseen: Sequence[str]) -> tuple[list[Path], list[Path]]:
    """Materials to show, and others to train on; without names, all and none.

    Raises
    ------
    NacreError
        If a name is unknown, no material is left to train on, or two files hold the same material.
    """
    for what in (lambda path: _plain(path.stem), digest):
        known: dict[str, Path] = {}
        for path in files:
            first = known.setdefault(what(path), path)
            if first is not path:
                raise NacreError(f"{first} and {path} hold the same material; give only one")
    names = {path.stem for path in files}
    if unknown := [name for name in unseen if name not in names]:
        raise NacreError(f"{unknown[0]}: is not one of the materials ({', '.join(sorted(names))})")
    if not unseen:
        return list(files), []
    others = [path for path in files if path.stem not in unseen]
    count, least = len(others), MIN_MATERIALS - 1
    if count < least:
        raise NacreError(f"--unseen leaves {count} materials to train on, expected {least} or more")
    return [path for path in files if path.stem in unseen], others


def seen_by(basis: LatentBasis, files: Sequence[Path]) -> list[str]:
    """Names of the materials in files that a basis was trained on.

    Materials are identified by name: "blue_felt", "Blue-Felt_rgb" and "blue-felt" are the same.

    Raises
    ------
    NacreError
        If the basis does not tell what it was trained on.
    """
    known = basis.metadata.get("materials")
    if not isinstance(known, list):
        raise NacreError("the basis does not say which materials it was trained on")
    trained = {_plain(str(name)) for name in known}
    return [path.stem for path in files if _plain(path.stem) in trained]


def unseen_bases(
    kind: str,
    shown: Sequence[Path],
    others: Sequence[Path],
    given: LatentBasis | None,
    settings: CodeSettings,
    cache: Cache,
    progress: Progress,
) -> UnseenBases:
    """For each material, a basis of a kind that has not seen it.

    It is the given basis if it is of that kind; else one trained on the other materials; else, if
    there are no others, the included one if it has seen none of the materials; else one of five,
    each trained on all but one fifth of the materials.

    Parameters
    ----------
    kind
        Kind of a :class:`nacre.latent.predicting.PredictingBasis`.
    shown
        Isotropic materials to predict lobes for.
    others
        Materials to train bases on; may be empty.
    given
        The user's basis, of any kind.
    settings
        Settings of trainings.
    cache
        Cache of trained bases.
    progress
        Called as it goes on.

    Raises
    ------
    TooFewError
        If there is no basis, and too few materials to train any.
    NacreError
        If the given basis has seen a material, the included one has and there are too few
        materials, or a training fails.
    """
    hashes = [digest(path) for path in shown]

    def same(basis: LatentBasis, about: str) -> UnseenBases:
        return UnseenBases(dict.fromkeys(hashes, cast(PredictingBasis, basis)), about)

    def train(training: Sequence[Path], report: Progress) -> LatentBasis:
        return bases(training, [kind], settings, cache, report)[kind]

    if given is not None and given.kind == kind:
        if seen := seen_by(given, shown):
            raise NacreError(f"the given basis was trained on {', '.join(seen)}; give another")
        return same(given, "the given basis")
    if others:
        return same(train(others, progress), f"trained on the {len(others)} other materials")
    included = find_basis(kind) if kind in PRETRAINED else None
    seen = seen_by(included, shown) if included else []
    if included and not seen:
        return same(included, "the included basis, which was trained on none of them")
    if len(shown) < MIN_MATERIALS:
        mend = f"give {MIN_MATERIALS} materials or more, some to keep --unseen, or a --basis"
        if seen:
            raise NacreError(f"the included basis was trained on {', '.join(seen)}; {mend}")
        raise TooFewError(f"no basis {kind!r} is included; {mend}")
    order = np.random.default_rng(settings.seed).permutation(len(shown))
    files = sorted(shown)
    found: dict[str, PredictingBasis] = {}
    for number, fold in enumerate(np.array_split(order, _FOLDS), 1):
        held = {files[index] for index in fold}
        rest = [path for path in files if path not in held]
        basis = train(rest, named(progress, f"basis {number} of {_FOLDS}"))
        found |= dict.fromkeys(map(digest, held), cast(PredictingBasis, basis))
    about = f"{_FOLDS} bases, each trained on four fifths of the materials, none of which it is for"
    return UnseenBases(found, about)


def _plain(name: str) -> str:
    """The name of a material, without the differences between names of its files."""
    plain = name.casefold().replace("_", "-")
    for end in _SAME:
        plain = plain.removesuffix(end)
    return plain
