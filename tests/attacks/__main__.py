"""Write the files of all attacks into folders of their names, and what each tries."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.attacks.files import ATTACKS

if __name__ == "__main__":
    for name, attack in ATTACKS.items():
        folder = Path(sys.argv[1]) / name
        folder.mkdir(parents=True, exist_ok=True)
        print(f"{attack.write(folder)}: {attack.tries}")
