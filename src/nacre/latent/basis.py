"""The interface of latent bases: spaces in which a code of few values stands for a reflectance."""

from __future__ import annotations

import abc
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from pkgutil import resolve_name
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Weights
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.io.tensors import Tensors
from nacre.latent.directions import check_isotropic
from nacre.numerics.direction_samples import DirectionSamples
from nacre.objects.described import Described, readable_size
from nacre.runtime.progress import Progress, silent

if TYPE_CHECKING:
    from nacre.latent.lobe_predictor import LobePredictor
    from nacre.latent.posterior import Posterior
    from nacre.latent.prior import Prior

LARGEST = 1e6  # bound of values of codes and of numbers of bases: products of them stay finite


class LatentBasis(Described):
    """A space of isotropic reflectances: it finds the code of one, and decodes any code.

    A subclass has a :attr:`kind` and a :attr:`Recipe`, and gives :meth:`decode`, :meth:`pack`,
    :meth:`unpack`, :meth:`train` or a :attr:`trainer`, and :meth:`encode` or its steps. Its entry
    in :data:`nacre.latent.BASES`, or an entry point `nacre.bases`, makes it known to the commands
    and to :func:`nacre.latent.load_basis`.
    """

    kind: ClassVar[str]
    """Its name in the registry and in files."""
    Recipe: ClassVar[type]
    """Settings of the training: a dataclass, one of whose fields is `code_dim`."""
    trainer: ClassVar[str]
    """What :meth:`train` runs, as "module:function" since most trainers need PyTorch: a function
    that takes materials, recipe, checkpoint and progress, and `base` where the basis builds on one.
    """
    builds_on: ClassVar[str | None] = None
    """Kind of the basis that :meth:`train` takes as its `base`; None where it needs none."""

    takes_samples: ClassVar[bool] = False
    """Whether a code can be found from scattered samples, however few."""
    projects: ClassVar[bool] = False
    """Whether there is a code that is not refined for pictures, from a projection or an encoder."""
    linear_in_log: ClassVar[bool] = False
    """Whether ln f_r is linear in the code."""
    decodes_networks: ClassVar[bool] = False
    """Whether what is decoded is a :class:`nacre.NeuralBrdf`, which is saved as any other."""

    metadata: dict[str, Any]
    """JSON-able facts about the training; "materials" are the names of what it was trained on."""
    predictors: Mapping[str, LobePredictor] = MappingProxyType({})
    """Networks that predict lobes for importance sampling, by the name of the parametrization."""

    @property
    @abc.abstractmethod
    def code_dim(self) -> int:
        """Number of values in a code."""

    @property
    @abc.abstractmethod
    def nbytes(self) -> int:
        """Memory of the basis, which all materials share."""

    @abc.abstractmethod
    def decode(self, code: npt.ArrayLike, name: str = "") -> CodedBrdf:
        """The reflectance that a code of shape (code_dim,) stands for; f_r is finite whatever the
        values.

        Raises ValueError if the code has another length, or a value is a million or more.
        """

    @abc.abstractmethod
    def pack(self) -> tuple[dict[str, Any], Tensors]:
        """JSON-able fields of a file's header beside the metadata, and the tensors."""

    @classmethod
    @abc.abstractmethod
    def unpack(cls, header: Mapping[str, Any], tensors: Tensors) -> Self:
        """The inverse of :meth:`pack`; the header also has "metadata".

        Raises KeyError, TypeError or ValueError if something is missing or does not fit; the caller
        names the file.
        """

    @classmethod
    def train(
        cls,
        materials: Sequence[Callable[[], Brdf]],
        recipe: Any = None,
        *,
        base: Any = None,
        checkpoint: Path | None = None,
        progress: Progress | None = None,
    ) -> Self:
        """A basis trained on materials.

        Raises FormatError if a material is anisotropic, and NacreError if there are fewer than two
        materials, one is known at none of the directions, training diverges, or the checkpoint is
        from another training or damaged.

        Parameters
        ----------
        materials
            Functions that return the materials, isotropic; each is called once, so that files need
            not be in memory together.
        recipe
            Settings, of the type :attr:`Recipe`; the recommended ones where None.
        base
            A basis of the kind :attr:`builds_on`; trained as well where None.
        checkpoint
            File that keeps the state of the training (:class:`nacre.runtime.store.Store`), from
            which a later call continues. The caller removes it once the basis is saved. Not used
            where training takes seconds.
        """
        given = {} if cls.builds_on is None else {"base": base}
        run: Callable[..., Self] = resolve_name(cls.trainer)
        return run(materials, recipe or cls.Recipe(), checkpoint, progress or silent, **given)

    @classmethod
    def recipe(cls, options: Mapping[str, Any]) -> Any:
        """Settings of the training, from options by the names of the :attr:`Recipe`'s fields.

        Raises NacreError if an option is not for this kind, or a value is out of range.
        """
        known = [field.name for field in fields(cls.Recipe)]
        for name in options:
            if name not in known:
                option = name.replace("_", "-")
                raise NacreError(f"{option} is not a setting of the basis {cls.kind!r}")
        try:
            return cls.Recipe(**options)
        except ValueError as error:
            raise NacreError(str(error)) from error

    def encode(
        self, source: Brdf | DirectionSamples, *, refine: bool = True, seed: int = 0
    ) -> Doubles:
        """The code of an isotropic material that comes closest in pictures, shape (code_dim,), in
        standard deviations of the training materials.

        Raises FormatError if the reflectance is anisotropic; ValueError if there is no sample;
        NacreError if it is known at none of the directions, too unlike the training materials, or
        the basis takes no samples or has no unrefined code.

        Parameters
        ----------
        source
            A reflectance, or samples of one. Where the basis :attr:`takes_samples`, a reflectance
            that was measured at scattered directions counts as its samples.
        refine
            False for the code that is not refined for pictures, where the basis :attr:`projects`.
        seed
            Chooses the directions of comparison: the same seed gives the same code.
        """
        if not refine and not self.projects:
            raise NacreError(f"the basis {self.kind!r} has no projection and no encoder")
        if isinstance(source, Brdf):
            check_isotropic(source)
            scan = source.scattered() if self.takes_samples else None
            if scan is None:
                return self._refined(source, seed) if refine else self._projected(source)
            source = scan.samples
        return self.posterior(source).code

    def posterior(self, samples: DirectionSamples, *, free_scale: bool = False) -> Posterior:
        """The codes that samples of an isotropic material, however few, leave possible.

        With `free_scale`, all samples may be wrong by one factor, which is found too. Raises
        NacreError if the basis takes no samples, ValueError if there is no sample.
        """
        if not self.takes_samples:
            raise NacreError(f"the basis {self.kind!r} finds no code from samples alone")
        return self._posterior(samples, free_scale)

    def _refined(self, brdf: Brdf, seed: int) -> Doubles:
        raise NotImplementedError

    def _projected(self, brdf: Brdf) -> Doubles:
        raise NotImplementedError

    def _posterior(self, samples: DirectionSamples, free_scale: bool) -> Posterior:
        raise NotImplementedError

    @property
    def prior(self) -> Prior:
        """How plausible codes are: like those of the training materials.

        Raises NacreError if the basis keeps no codes of its training materials.
        """
        raise NacreError(f"the basis {self.kind!r} does not know what materials are like")

    def fingerprint(self, *, predictors: bool = False) -> str:
        """SHA-256 of what a code means here, and of what is predicted from it too if asked for."""
        own, tensors = (self if predictors else self._without_predictors()).pack()
        digest = hashlib.sha256(json.dumps(own).encode())
        for name in sorted(tensors):
            digest.update(tensors[name].tobytes())
        return digest.hexdigest()

    def summary(self) -> str:
        return f"{self.code_dim} values, {readable_size(self.nbytes)}"

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary()}>"

    def _without_predictors(self) -> LatentBasis:
        """The same space of codes: predictors may be trained again."""
        return self

    def describe(self) -> dict[str, Any]:
        """Facts about the basis in the order they should be shown, JSON-able."""
        materials = self.metadata.get("materials")
        facts = {
            "kind": self.kind,
            "code dim": self.code_dim,
            "memory bytes": self.nbytes,
            "materials in training": len(materials) if isinstance(materials, list) else None,
            "predicts lobes": ", ".join(self.predictors) or None,
        }
        for name, value in self.metadata.items():
            if isinstance(value, dict):
                facts |= {f"{name}, {key.replace('_', ' ')}": v for key, v in value.items()}
            elif name != "materials":
                facts[name.replace("_", " ")] = value
        return {name: value for name, value in facts.items() if value is not None}

    def checked(self, code: npt.ArrayLike) -> Weights:
        """A code of this basis, as float32.

        Raises ValueError if it has another length, or a value is a million or more.
        """
        values = np.asarray(code, np.float64)
        if values.shape != (self.code_dim,) or not (np.abs(values) < LARGEST).all():
            raise ValueError(
                f"a code has {self.code_dim} values below a million, got {values.shape}"
            )
        return values.astype(np.float32)


def integer(header: Mapping[str, Any], name: str) -> int:
    """A whole number in a file's header; KeyError or ValueError if it is missing or not one."""
    value = header[name]
    if type(value) is not int:
        raise ValueError(f"{name} is not a whole number")
    return value


def integers(header: Mapping[str, Any], name: str) -> list[int]:
    """Whole numbers in a file's header; see :func:`integer`."""
    values = header[name]
    if not isinstance(values, list) or any(type(value) is not int for value in values):
        raise ValueError(f"{name} is not a list of whole numbers")
    return values


class CodedBrdf(Brdf):
    """A reflectance that a code stands for.

    Subclasses take the basis, a code of shape (k,), which is kept as float32, and the name of the
    material; they raise ValueError if the code has another length, or a value is a million or more.
    """

    basis: LatentBasis
    code: Weights  # shape (code_dim,)

    def describe(self) -> dict[str, Any]:
        return super().describe() | {
            "code dim": len(self.code),
            "code bytes": self.code.nbytes,
            "basis bytes": self.basis.nbytes,
        }
