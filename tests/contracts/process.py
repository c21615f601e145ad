"""A process of one instruction set: what it makes of pickled materials and samplers, as `.npz`.

python -m tests.contracts.process AVX2 IN.pickle OUT.npz compiled numpy torch
"""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

from tests.contracts.processors import PROCESSORS, take_for

if __name__ == "__main__":
    processor = PROCESSORS[sys.argv[1]]
    take_for(processor)

    import numpy as np

    from tests.contracts.results import results

    objects = pickle.loads(Path(sys.argv[2]).read_bytes())
    np.savez(sys.argv[3], **results(objects, processor, sys.argv[4:]))
