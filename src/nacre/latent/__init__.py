"""A space of materials: few values that stand for a whole reflectance."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "encoding": ["encode", "encode_neural", "encode_samples"],
        "lobe_predictor": ["LobePredictor"],
        "neural_basis": ["NeuralBasis", "NeuralBasisBrdf"],
        "neural_recipe": ["BasisRecipe"],
        "neural_training": ["train_neural"],
        "pca": ["Basis", "PcaBrdf"],
        "predictor_recipe": ["PredictorRecipe"],
        "predictor_training": ["train_predictors", "with_predictors"],
        "refine": ["optimised"],
        "training": ["train"],
    },
)
