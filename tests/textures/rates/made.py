"""Maps of codes with structure, for tests of rates."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from nacre.measured.textures import UTIA
from nacre.textures import LatentMap
from nacre.textures.codecs.basis import BasisRecipe
from tests.textures.codecs.basis.made import codec

SIZES = BasisRecipe(
    code_dim=6, luma_count=8, chroma_count=3, width=6, depth=2, wide=8, hidden=5, completing=7
)


def latent(height: int = 70, width: int = 150) -> LatentMap:
    """Codes of six values, some of which vary ten times as much as others, smooth in places."""
    random = np.random.default_rng(4)
    turn, _ = np.linalg.qr(random.normal(size=(6, 6)))
    rough = random.normal(size=(height, width, 6))
    smooth = 6.0 * gaussian_filter(rough, (3.0, 3.0, 0.0), mode="wrap")
    places = (0.15 * rough + smooth) * np.geomspace(1.0, 0.1, 6)
    codes = np.asarray(-0.2 + places @ turn, np.float32)
    facts = {"errors": {"MSE x 1e4": 2.5, "relative RMSE": 0.1}}
    return LatentMap(codes, codec(sizes=SIZES), *UTIA.pairs(), "felt", None, facts)
