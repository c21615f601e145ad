"""When pairs of directions count as the same."""

import numpy as np

from nacre.measured.textures import BONN
from nacre.measured.textures.directions import same_pairs


def test_pairs_are_the_same_in_their_order_but_for_digits_that_lists_leave_out() -> None:
    wi, wo = BONN.pairs()
    assert same_pairs(wi, wo, wi.round(3), wo.round(3))
    assert not same_pairs(wi, wo, wi.round(2), wo)
    assert not same_pairs(wi, wo, wi, wo.round(2))
    assert not same_pairs(wi, wo, wi[::-1], wo[::-1])
    assert not same_pairs(wi, wo, wi[:-1], wo[:-1])
    one = wi.copy()
    one[5, 0] = np.nan
    assert not same_pairs(wi, wo, one, wo)
