"""Which pairs of directions to measure, so that few samples say most of a material."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "design": ["Design", "neural_basis"],
        "instrument": ["Exposures", "Instrument"],
        "next_pairs": ["Proposal", "propose"],
    },
)
