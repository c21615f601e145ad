"""Small scans as text: Cornell files and comma-separated samples."""

from __future__ import annotations

from random import Random

from tests.specimens.specimen import NUMBERS, VALUES, Specimen

_ROWS = ((0.3, 0.0, 0.5, -2.0), (1.0, 0.0, 1.2, 3.1), (0.3, 0.0, 1.2, 0.7), (0.6, 1.0, 0.2, 0.1))


def _cornell_file(value: float = 0.25, bands: int = 3) -> bytes:
    lines = ["# Cornell University, Program of Computer Graphics", "# Test Paint", str(bands)]
    lines.append("450.0 550.0 650.0")
    lines += [" ".join(map(str, (*row, 0.1, 0.2, value))) for row in _ROWS]
    return ("\n".join(lines) + "\n").encode()


def _csv_file(value: float = 0.25, columns: str = "r,g,b") -> bytes:
    lines = ["# name: red paint", "# units: radians", f"theta_i,phi_i,theta_o,phi_o,{columns}"]
    lines += [",".join(map(str, (*row, 0.1, 0.2, value))) for row in _ROWS]
    return ("\n".join(lines) + "\n").encode()


def _text_rebuilt(data: bytes, random: Random) -> bytes:
    """Lines of a text in another order, with words of it replaced."""
    words = [str(n).encode() for n in (*NUMBERS, *VALUES)]
    words += [b"", b"theta_i", b"550 nm", b"theta_o [deg]", b"isotropic: no", b"1_0", b"0x10"]
    words += ["٣".encode(), b"\xff", b"\0", b"9" * 400, b"#", b"\x85", b"\x1c", b"name: x"]
    lines = data.split(b"\n")
    for _ in range(random.randint(1, 4)):
        place = random.randrange(len(lines))
        mark = b"," if b"," in lines[place] else b" "
        parts = lines[place].split(mark)
        parts[random.randrange(len(parts))] = random.choice(words)
        lines[place] = mark.join(parts)
        if random.random() < 0.2:
            lines.insert(random.randrange(len(lines)), random.choice(lines))
        if random.random() < 0.1:
            lines[random.randrange(len(lines)) :] = [b""]
    return b"\n".join(lines)


SPECIMENS = {
    "Cornell scan": Specimen(
        "paint.brdf",
        lambda: [_cornell_file()],
        header=100,
        sized=lambda count: [_cornell_file(bands=count)],
        valued=lambda value: [_cornell_file(value)],
        rebuild=_text_rebuilt,
        text=True,
    ),
    "comma-separated samples": Specimen(
        "paint.csv",
        lambda: [_csv_file(), _csv_file(columns="450,550 nm,650 [nm]".replace(" [nm]", ""))],
        header=100,
        sized=lambda _: [],
        valued=lambda value: [_csv_file(value)],
        rebuild=_text_rebuilt,
        text=True,
    ),
}
