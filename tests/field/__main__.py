"""Write the table of real files into its page: `python -m tests.field`."""

from __future__ import annotations

from tests.data import data_folder
from tests.field.table import BEGIN, END, table
from tests.field.test_field import PAGE


def main() -> None:
    folder = data_folder()
    if folder is None:
        raise SystemExit("no real files: set NACRE_DATA to the folder that holds field/")
    text = PAGE.read_text(encoding="utf-8")
    start, end = text.index(BEGIN) + len(BEGIN), text.index(END)
    PAGE.write_text(f"{text[:start]}{table(folder / 'field')}{text[end:]}", encoding="utf-8")


if __name__ == "__main__":
    main()
