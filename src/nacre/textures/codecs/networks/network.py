"""What both networks share: tensors, preprocessing, and the interface of a codec."""

from __future__ import annotations

import abc
import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.io.tensors import Tensors, check_header, check_unit_vectors, in_precision, in_single
from nacre.numerics.mlp import Layer, forward
from nacre.runtime.device import one_thread
from nacre.runtime.parallel import thread_map
from nacre.textures.codecs.codec import Filter, TexelCodec, TexelMap, check_shape
from nacre.textures.codecs.networks.mlp import (
    INPUTS,
    Shapes,
    Tensor,
    direction_inputs,
    initial,
    mlp_layers,
    mlp_shapes,
    settings_from_json,
    torch,
)
from nacre.textures.codecs.networks.preprocessing import Whitening

_Part = TypeVar("_Part")
_Settings = TypeVar("_Settings")

_CHUNK = 64  # texels that are encoded at a time
_ROWS = 1 << 11
"""Pairs of a code and directions that are decoded at a time: their layers stay in the cache."""
_COEFFICIENTS = 128  # width of the layer between a code and the bilinear decoder's coefficients
_VERSION = 1
_VALUES = "whitened log(pi f_r + offset), linear Rec. 709"
DIRECTIONS = "wi", "wo"


class TexelNetwork(TexelCodec):
    """An encoder of texels and the decoder of their codes.

    The settings are sizes: a frozen dataclass with fields `latent`, `decoder` and `decoder_hidden`.
    Reflectance is whitened before the encoder, and restored after the decoder. Parameters are
    tensors by the names of :meth:`shapes`; random ones where None, see
    :func:`nacre.textures.codecs.networks.mlp.initial`. A ValueError says that tensors are missing
    or have other shapes than the settings ask for.
    """

    uses_all_cores = True
    hit_form = "network"
    filtered_by: ClassVar[Filter] = "codes"  # as in Rainer et al. 2020, section 5.2
    settings_type: ClassVar[type[Any]]
    """Type of the settings."""
    starts: ClassVar[Mapping[str, float]] = {}
    """What tensors are full of before training, of those that do not begin at random."""
    fixed_directions: ClassVar[bool] = False
    """Whether texels are encoded at one set of pairs of directions only: attributes `wi` and `wo`,
    shape (n, 3), which the constructor takes."""

    def __init__(
        self,
        settings: Any,
        whitening: Whitening,
        parameters: dict[str, npt.NDArray[np.float32]] | None = None,
        seed: int = 0,
        variance: str = "he",
    ) -> None:
        self.settings, self.whitening = settings, whitening
        self.metadata = {}
        self.code_dim = settings.latent
        shapes = self.shapes() | self._decoder_shapes()
        if parameters is None:
            parameters = initial(shapes, np.random.default_rng((seed, 1)), variance)
            for name, start in self.starts.items():
                parameters[name][:] = start
        found = {name: array.shape for name, array in parameters.items()}
        if found != shapes:
            wrong = sorted(k for k in found | shapes if found.get(k) != shapes.get(k))[0]
            raise ValueError(
                f"tensor {wrong!r} is {found.get(wrong, 'missing')}, "
                f"expected {shapes.get(wrong, 'none')}"
            )
        self.parameters = {name: torch.tensor(parameters[name]) for name in shapes}

    @abc.abstractmethod
    def shapes(self) -> Shapes:
        """Names and shapes of the encoder's tensors."""

    @abc.abstractmethod
    def prepare_encoder(self, directions: Tensor) -> Any:
        """The part of the encoder that depends on the pairs of directions only.

        Directions are stereographic coordinates of light and viewer, shape (n, 4).
        """

    @abc.abstractmethod
    def encode(self, values: Tensor, prepared: Any) -> Tensor:
        """Codes, shape (b, L), of whitened texels of shape (b, 3, n)."""

    def _decoder_shapes(self) -> Shapes:
        hidden = self.settings.decoder_hidden
        if self.settings.decoder == "network":
            return mlp_shapes("decoder", (self.code_dim + INPUTS, *hidden, 3))
        coefficients = self.code_dim, _COEFFICIENTS, 3 * hidden[-1]
        return mlp_shapes("features", (INPUTS, *hidden)) | mlp_shapes("coefficients", coefficients)

    def prepare_decoder(self, directions: Tensor) -> Tensor:
        """The part of the decoder that depends on the pairs of directions only, shape (n, width).

        Directions are stereographic coordinates of light and viewer, shape (n, 4).
        """
        if self.settings.decoder == "bilinear":
            features = forward(directions, mlp_layers(self.parameters, "features"))
            return features / math.sqrt(self.settings.decoder_hidden[-1])
        weight, bias = mlp_layers(self.parameters, "decoder")[0]
        return torch.addmm(bias, directions, weight[self.code_dim :])

    def decode(self, codes: Tensor, prepared: Tensor) -> Tensor:
        """Whitened logarithms, shape (b, n, 3), of codes of shape (b, L).

        The part of the first layer that sees the code is evaluated once per code.
        """
        if self.settings.decoder == "bilinear":
            coefficients = forward(codes, mlp_layers(self.parameters, "coefficients"))
            products = coefficients.reshape(-1, prepared.shape[1]) @ prepared.mT
            return products.reshape(len(codes), 3, -1).mT
        (weight, _), *others = mlp_layers(self.parameters, "decoder")
        first = (codes @ weight[: self.code_dim])[:, None] + prepared
        values = forward(first.relu_().flatten(0, 1), others)
        return values.reshape(len(codes), len(prepared), 3)

    def to(self, device: Any) -> Self:
        moved = {name: p.detach().to(device) for name, p in self.parameters.items()}
        return self.replaced(parameters=moved)

    def arrays(self) -> dict[str, npt.NDArray[np.float32]]:
        return {name: p.detach().cpu().numpy().copy() for name, p in self.parameters.items()}

    def check_directions(self, wi: Floats, wo: Floats) -> None:
        """Refuse pairs of directions that texels cannot be encoded at, by a :class:`NacreError`."""

    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        self.check_directions(wi, wo)
        with torch.inference_mode():
            prepared = self.prepare_encoder(self._inputs(wi, wo))

        def encode(texels: Floats) -> Floats:
            check_shape("texels", texels, len(wi), 3)
            codes = np.empty((len(texels), self.code_dim), np.float32)

            def run(start: int) -> None:
                rows = slice(start, start + _CHUNK)
                part = np.require(texels[rows], np.float32, ["C", "W"])  # as PyTorch wants it
                values = torch.empty((len(part), 3, len(wi)), device=self._device)
                values.copy_(torch.from_numpy(part).mT)
                found = self.encode(self.whitening.whiten_(values), prepared)
                codes[rows] = found.cpu().numpy()

            self._share_out(run, range(0, len(texels), _CHUNK))
            return codes

        return encode

    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        count = len(wi)
        texels = max(1, _ROWS // max(count, 1))
        with torch.inference_mode():
            prepared = self.prepare_decoder(self._inputs(wi, wo))

        def decode(codes: Floats) -> Floats:
            check_shape("codes", codes, self.code_dim)
            given = torch.from_numpy(np.array(codes, np.float32)).to(self._device)
            reflectance = np.empty((len(given), count, 3), np.float32)
            target = torch.from_numpy(reflectance)

            def run(place: tuple[int, int]) -> None:
                rows, pairs = slice(place[0], place[0] + texels), slice(place[1], place[1] + _ROWS)
                whitened = self.decode(given[rows], prepared[pairs])
                target[rows, pairs] = self.whitening.restore_(whitened).cpu()

            starts = range(0, len(given), texels), range(0, count, _ROWS)
            self._share_out(run, itertools.product(*starts))
            return reflectance

        return decode

    def hit_layers(self) -> list[Layer]:
        """Layers of the decoder with ReLUs between them, for renderers.

        They map a code and the stereographic coordinates of light and viewer to whitened
        logarithms. A NacreError says that the decoder is not the papers'.
        """
        if self.settings.decoder != "network":
            raise NacreError(
                f"a {self.settings.decoder} decoder cannot run at every hit; take decoder 'table'"
            )
        return [Layer(*pair) for pair in mlp_layers(self.arrays(), "decoder")]

    def describe(self) -> dict[str, Any]:
        sizes = {name.replace("_", " "): value for name, value in asdict(self.settings).items()}
        del sizes["latent"]
        return {k: list(v) if isinstance(v, tuple) else v for k, v in sizes.items()}

    def pack(self, precision: str | None = "single") -> tuple[dict[str, Any], Tensors]:
        tensors = in_precision(self.arrays(), precision)
        if self.fixed_directions:
            tensors |= {name: getattr(self, name) for name in DIRECTIONS}  # single always
        header = {"version": _VERSION, "model": self.kind, "settings": asdict(self.settings)}
        header |= {"values": _VALUES, "whitening": asdict(self.whitening)}
        return header | {"metadata": self.metadata}, tensors

    @classmethod
    def unpack(cls, header: dict[str, Any], tensors: Tensors) -> TexelNetwork:
        check_header(header, _VERSION)
        whitening = Whitening(**{key: float(value) for key, value in header["whitening"].items()})
        settings = settings_from_json(cls.settings_type, header["settings"])
        arrays = in_single({k: v for k, v in tensors.items() if k not in DIRECTIONS})
        fixed: dict[str, Any] = {n: tensors[n] for n in DIRECTIONS if cls.fixed_directions}
        check_unit_vectors(fixed)
        made = cls(settings=settings, whitening=whitening, parameters=arrays, **fixed)
        return made.replaced(metadata=header["metadata"])

    def _share_out(self, run: Callable[[_Part], None], parts: Iterable[_Part]) -> None:
        """Do parts of some work; on a CPU, each core does one at a time.

        Each part is small enough for the cache of one core; PyTorch's own threads would share each
        part and wait for one another.
        """
        if self._device.type != "cpu":
            with torch.inference_mode():
                for part in parts:
                    run(part)
            return

        def alone(part: _Part) -> None:
            torch.set_num_threads(1)
            with torch.inference_mode():
                run(part)

        with one_thread():
            for _ in thread_map(alone, parts):
                pass

    @property
    def _device(self) -> Any:
        return next(iter(self.parameters.values())).device

    def _inputs(self, wi: Floats, wo: Floats) -> Tensor:
        return torch.from_numpy(direction_inputs(wi, wo)).to(self._device)
