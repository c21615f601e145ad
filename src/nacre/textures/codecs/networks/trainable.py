"""How a user trains one of the networks: settings, and the call of the training."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from nacre.errors import NacreError, reason
from nacre.textures.codecs.codec import TrainingRun
from nacre.textures.codecs.networks.network import TexelNetwork
from nacre.textures.codecs.networks.recipe import NetworkRecipe, TrainingRecipe


class TrainableNetwork(TexelNetwork):
    """A network with defaults for its training."""

    distributed = True
    journaled = True
    training_defaults: ClassVar[Mapping[str, Any]] = {}
    """Settings of a :class:`nacre.textures.codecs.networks.recipe.TrainingRecipe` that the network
    is trained with unless others are given."""
    recipe_defaults: ClassVar[Mapping[str, Any]] = {}  # more of them, for nacre's own recipe

    @classmethod
    def recipe(
        cls,
        *,
        code_dim: int | None = None,
        seed: int = 0,
        steps: int | None = None,
        minutes: float | None = None,
        epochs: int | None = None,
        preset: str = "default",
        pooling: str | None = None,
        decoder: str | None = None,
        decoder_hidden: tuple[int, ...] | None = None,
        loss: str | None = None,
        batch: int | None = None,
        learning_rate: float | None = None,
        patience: int = 0,
        precision: str | None = None,
        device: str = "cpu",
    ) -> NetworkRecipe:
        """Sizes of the network and settings of its training; what is None has the default of its
        kind.

        `code_dim`, `pooling`, `decoder` and `decoder_hidden` are fields of the network's settings;
        `preset` is one of :data:`nacre.textures.codecs.networks.recipe.RECIPES`, and the settings
        behind it are those of :class:`nacre.textures.codecs.networks.recipe.TrainingRecipe`. At
        most one of `steps`, `minutes` and `epochs` says how long to train. A NacreError says that a
        setting is impossible.
        """
        if len(_given(steps=steps, minutes=minutes, epochs=epochs)) > 1:
            raise NacreError("steps, minutes and epochs: give one of them")
        sizes = _given(latent=code_dim, decoder=decoder, decoder_hidden=decoder_hidden)
        sizes |= _given(pooling=pooling)
        chosen = _given(loss=loss, batch=batch, learning_rate=learning_rate, precision=precision)
        chosen |= {"patience": patience, "seed": seed} | _given(epochs=epochs)
        defaults = cls.recipe_defaults if preset == "default" else {}
        try:
            settings = cls.settings_type(**sizes)
            chosen = {**defaults, **cls.training_defaults, **chosen}
            training = TrainingRecipe.named(preset, **chosen)
        except (TypeError, ValueError) as error:
            raise NacreError(reason(error)) from error
        return NetworkRecipe(settings, training, steps, minutes, device)

    @classmethod
    def recipe_settings(cls) -> list[str]:
        has_pooling = hasattr(cls.settings_type, "pooling")
        return [name for name in super().recipe_settings() if name != "pooling" or has_pooling]

    @classmethod
    def train(cls, run: TrainingRun, recipe: NetworkRecipe) -> TexelNetwork:
        from nacre.textures.codecs.networks.training import train_network

        return train_network(cls, run, recipe)


def _given(**settings: Any) -> dict[str, Any]:
    return {name: value for name, value in settings.items() if value is not None}
