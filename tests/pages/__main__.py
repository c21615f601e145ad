"""Type the pages, and say how long each line took: `python -m tests.pages [PAGE...]`.

`--python PATH` types with the nacre that is installed beside that Python, such as one of a clean
environment; the lines then see nothing of this checkout.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from tests.pages.pages import PAGES, ROOT, extras, type_page


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.pages")
    parser.add_argument("pages", type=lambda name: Path(name).resolve(), nargs="*", metavar="PAGE")
    parser.add_argument("--python", type=lambda name: Path(name).absolute())
    given = parser.parse_args()
    failed = []
    for page in given.pages or PAGES:
        name = page.relative_to(ROOT)
        print(f"{name}: needs {', '.join(extras(page))}", flush=True)
        if type_page(page, given.python).returncode:
            failed.append(str(name))
    print(f"failed: {', '.join(failed)}" if failed else "all lines of all pages ran")
    return bool(failed)


if __name__ == "__main__":
    raise SystemExit(main())
