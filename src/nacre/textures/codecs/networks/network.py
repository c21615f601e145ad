"""What both networks share: tensors, preprocessing, and the interface of a codec."""

from __future__ import annotations

import abc
import itertools
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, TypeVar

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.geometry import split, stereographic
from nacre.runtime.parallel import thread_map
from nacre.textures.codecs.codec import TexelCodec, TexelMap
from nacre.textures.codecs.networks.mlp import DECODERS, Decoder, Shapes, Tensor, initial, torch
from nacre.textures.codecs.networks.preprocessing import Whitening

_Part = TypeVar("_Part")

_CHUNK = 64
"""Texels that are encoded at a time."""
_ROWS = 1 << 11
"""Pairs of a code and directions that are decoded at a time: their layers stay in the cache."""
_MOST, _WIDEST = 16, 1 << 13
"""Layers and width of networks."""


class TexelNetwork(TexelCodec):
    """An encoder of texels and the decoder of their codes.

    Parameters
    ----------
    settings
        Sizes; a frozen dataclass with fields `latent`, `decoder` and `decoder_hidden`.
    whitening
        What is done to reflectance before the encoder, and undone after the decoder.
    parameters
        Tensors by the names of :meth:`shapes`; random ones where None.
    metadata
        JSON-able facts about the training.
    seed, variance
        Of the random ones; see :func:`nacre.textures.codecs.networks.mlp.initial`.

    Raises
    ------
    ValueError
        If tensors are missing or have other shapes than the settings ask for.
    """

    model: ClassVar[str]
    """What files and commands call the network."""
    uses_all_cores = True
    fixed_directions: bool = False
    """Whether texels are encoded at one set of pairs of directions only."""

    def __init__(
        self,
        settings: Any,
        whitening: Whitening,
        parameters: dict[str, npt.NDArray[np.float32]] | None = None,
        *,
        metadata: dict[str, Any] | None = None,
        seed: int = 0,
        variance: str = "he",
    ) -> None:
        self.settings, self.whitening = settings, whitening
        self.metadata = metadata or {}
        self.values = settings.latent
        self._decoder = Decoder(settings.latent, settings.decoder_hidden, settings.decoder)
        shapes = self.shapes() | self._decoder.shapes()
        if parameters is None:
            parameters = self._adjusted(initial(shapes, np.random.default_rng((seed, 1)), variance))
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

    def _adjusted(
        self, arrays: dict[str, npt.NDArray[np.float32]]
    ) -> dict[str, npt.NDArray[np.float32]]:
        """Random tensors, with those replaced that do not begin at random."""
        return arrays

    @abc.abstractmethod
    def prepare_encoder(self, directions: Tensor) -> Any:
        """What of the encoder depends on the pairs of directions only.

        Parameters
        ----------
        directions
            Stereographic coordinates of light and viewer, shape (n, 4).
        """

    @abc.abstractmethod
    def encode(self, values: Tensor, prepared: Any) -> Tensor:
        """Codes, shape (b, L), of whitened texels of shape (b, 3, n)."""

    def prepare_decoder(self, directions: Tensor) -> Tensor:
        """See :meth:`nacre.textures.codecs.networks.mlp.Decoder.prepare`."""
        return self._decoder.prepare(self.parameters, directions)

    def decode(self, codes: Tensor, prepared: Tensor) -> Tensor:
        """See :meth:`nacre.textures.codecs.networks.mlp.Decoder.decode`."""
        return self._decoder.decode(self.parameters, codes, prepared)

    def to(self, device: Any) -> None:
        """Move the tensors to a PyTorch device."""
        self.parameters = {name: p.detach().to(device) for name, p in self.parameters.items()}

    def arrays(self) -> dict[str, npt.NDArray[np.float32]]:
        """Copies of the tensors."""
        return {name: p.detach().cpu().numpy().copy() for name, p in self.parameters.items()}

    def check_directions(self, wi: Floats, wo: Floats) -> None:
        """Refuse pairs of directions that texels cannot be encoded at.

        Raises
        ------
        NacreError
            If the network is for others only.
        """

    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :meth:`nacre.textures.codecs.TexelCodec.encoder`.

        Raises
        ------
        NacreError
            If the network is for other directions only.
        """
        self.check_directions(wi, wo)
        with torch.inference_mode():
            prepared = self.prepare_encoder(self._inputs(wi, wo))

        def encode(texels: Floats) -> Floats:
            if texels.shape[1:] != (len(wi), 3):
                raise ValueError(f"texels are {texels.shape}, expected (b, {len(wi)}, 3)")
            codes = np.empty((len(texels), self.values), np.float32)

            def run(start: int) -> None:
                rows = slice(start, start + _CHUNK)
                part = np.require(texels[rows], np.float32, ["C", "W"])  # as PyTorch wants it
                values = torch.empty((len(part), 3, len(wi)), device=self._device)
                values.copy_(torch.from_numpy(part).mT)
                found = self.encode(self.whitening.whiten_(values), prepared)
                codes[rows] = found.cpu().numpy()

            self._spread(run, range(0, len(texels), _CHUNK))
            return codes

        return encode

    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :meth:`nacre.textures.codecs.TexelCodec.decoder`."""
        count = len(wi)
        texels = max(1, _ROWS // max(count, 1))
        with torch.inference_mode():
            prepared = self.prepare_decoder(self._inputs(wi, wo))

        def decode(codes: Floats) -> Floats:
            if codes.shape[1:] != (self.values,):
                raise ValueError(f"codes are {codes.shape}, expected (b, {self.values})")
            given = torch.from_numpy(np.array(codes, np.float32)).to(self._device)
            reflectance = np.empty((len(given), count, 3), np.float32)
            target = torch.from_numpy(reflectance)

            def run(place: tuple[int, int]) -> None:
                rows, pairs = slice(place[0], place[0] + texels), slice(place[1], place[1] + _ROWS)
                whitened = self.decode(given[rows], prepared[pairs])
                target[rows, pairs] = self.whitening.restore_(whitened).cpu()

            starts = range(0, len(given), texels), range(0, count, _ROWS)
            self._spread(run, itertools.product(*starts))
            return reflectance

        return decode

    def _spread(self, run: Callable[[_Part], None], parts: Iterable[_Part]) -> None:
        """Do parts of some work, on a CPU one a core at a time.

        Each is small enough for the cache of one core; PyTorch's own threads would share each part
        and wait for one another.
        """
        if self._device.type != "cpu":
            with torch.inference_mode():
                for part in parts:
                    run(part)
            return
        threads = torch.get_num_threads()

        def alone(part: _Part) -> None:
            torch.set_num_threads(1)
            with torch.inference_mode():
                run(part)

        try:
            for _ in thread_map(alone, parts):
                pass
        finally:
            torch.set_num_threads(threads)

    @property
    def _device(self) -> Any:
        return next(iter(self.parameters.values())).device

    def _inputs(self, wi: Floats, wo: Floats) -> Tensor:
        return torch.from_numpy(direction_inputs(wi, wo)).to(self._device)


def direction_inputs(wi: Floats, wo: Floats) -> npt.NDArray[np.float32]:
    """Stereographic coordinates of light and viewer, shape (n, 4)."""
    parts = (*stereographic(split(wi)), *stereographic(split(wo)))
    return np.stack(parts, axis=-1).astype(np.float32)


def check_sizes(latent: int, decoder: str, **widths: tuple[int, ...]) -> None:
    """Refuse settings of a network that none can have.

    Raises
    ------
    ValueError
        With the name of the setting.
    """
    if decoder not in DECODERS:
        raise ValueError(f"decoder must be one of {', '.join(DECODERS)}, got {decoder!r}")
    for name, values in {"latent": (latent,), **widths}.items():
        if not 1 <= len(values) <= _MOST or not all(1 <= v <= _WIDEST for v in values):
            raise ValueError(f"{name} must be widths of 1 to {_WIDEST:,}, got {values}")
