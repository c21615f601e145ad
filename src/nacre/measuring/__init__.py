"""Plans of few measurements, and virtual measurements of Mitsuba BSDFs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "bsdf": ["described_bsdf", "scene_bsdf"],
        "design": ["Design"],
        "instrument": ["Exposures", "Instrument"],
        "next_pairs": ["Proposal", "propose"],
        "virtual": ["MitsubaBrdf"],
    },
)
