"""A space of materials: few values that stand for a whole reflectance."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "autoencoder": ["Autoencoder"],
        "autoencoder_training": ["train_autoencoder"],
        "encoding": ["encode", "encode_network", "encode_neural"],
        "hypernetwork": ["Hypernetwork"],
        "hypernetwork_training": ["train_hypernetwork"],
        "lobe_predictor": ["LobePredictor"],
        "neural_basis": ["NeuralBasis", "NeuralBasisBrdf"],
        "neural_training": ["train_neural"],
        "pca": ["Basis", "PcaBrdf"],
        "posterior": ["encode_samples"],
        "predictor_training": ["train_predictors", "with_predictors"],
        "recipes": [
            "AutoencoderRecipe",
            "BasisRecipe",
            "HypernetworkRecipe",
            "PredictorRecipe",
        ],
        "refine": ["optimised"],
        "pretrained": ["find_basis", "pretrained_basis", "pretrained_hypernetwork"],
        "training": ["train"],
        "weights": ["CodedNetwork"],
    },
)
