"""A space of materials: few values that stand for a whole reflectance."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "autoencoder": ["Autoencoder"],
        "basis": ["CodedBrdf", "LatentBasis"],
        "estimates": ["bounds", "plausible"],
        "file": [
            "BASES",
            "find_basis",
            "is_code",
            "load_basis",
            "load_code",
            "pretrained_basis",
            "pretrained_hypernetwork",
            "save_basis",
            "save_code",
        ],
        "hypernetwork": ["Hypernetwork"],
        "lobe_predictor": ["LobePredictor"],
        "neural_basis": ["NeuralBasis", "NeuralBasisBrdf"],
        "pca": ["PcaBasis", "PcaBrdf"],
        "prior": ["Prior"],
        "predictor_training": ["train_predictors", "with_labels", "with_predictors"],
        "recipes": [
            "AutoencoderRecipe",
            "BasisRecipe",
            "HypernetworkRecipe",
            "PcaRecipe",
            "PredictorRecipe",
        ],
        "weights": ["CodedNetwork"],
    },
)
