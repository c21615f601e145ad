"""A space of materials: few values that stand for a whole reflectance."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "encoding": ["encode", "encode_neural"],
        "posterior": ["encode_samples"],
        "neural_basis": ["NeuralBasis", "NeuralBasisBrdf"],
        "neural_recipe": ["BasisRecipe"],
        "neural_training": ["train_neural"],
        "pca": ["Basis", "PcaBrdf"],
        "refine": ["optimised"],
        "training": ["train"],
    },
)
