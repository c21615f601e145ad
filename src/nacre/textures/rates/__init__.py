"""Maps of numbers in few bytes: a wavelet, its rounded bands as bytes, codes made from them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__, submod_attrs={"rated_codes": ["RatedCodes"]}
)
