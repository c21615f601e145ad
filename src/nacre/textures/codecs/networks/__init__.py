"""The networks of Rainer et al. 2019 and 2020 and the training of both."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "custom": ["CustomNetwork", "CustomSettings"],
        "network": ["TexelNetwork"],
        "preprocessing": ["Whitening"],
        "recipe": ["NetworkRecipe", "TrainingRecipe"],
        "training": ["train_network"],
        "unified": ["UnifiedNetwork", "UnifiedSettings"],
    },
)
