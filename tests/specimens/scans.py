"""Small scans as text: Cornell files, separated values and ASTM E1392 files."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from tests.specimens.specimen import NUMBERS, VALUES, Specimen

_ROWS = ((0.3, 0.0, 0.5, -2.0), (1.0, 0.0, 1.2, 3.1), (0.3, 0.0, 1.2, 0.7), (0.6, 1.0, 0.2, 0.1))


def _cornell_file(value: float = 0.25, bands: int = 3) -> bytes:
    lines = ["# Cornell University, Program of Computer Graphics", "# Test Paint", str(bands)]
    lines.append("450.0 550.0 650.0")
    lines += [" ".join(map(str, (*row, 0.1, 0.2, value))) for row in _ROWS]
    return ("\n".join(lines) + "\n").encode()


def _csv_file(value: float = 0.25, columns: str = "r,g,b", separator: str = ",") -> bytes:
    rows = [["theta_i", "phi_i", "theta_o", "phi_o", *columns.split(",")]]
    rows += [[*map(str, (*row, 0.1, 0.2, value))] for row in _ROWS]
    lines = [separator.join(row[: len(rows[0])]) for row in rows]
    return ("\n".join(["# name: red paint", "# units: radians", *lines]) + "\n").encode()


def _csv_files() -> list[bytes]:
    whole = _csv_file()
    degrees = whole.replace(b"# units: radians\n", b"# isotropic: no\n# samples: 4\n")
    for name in (b"theta_i", b"phi_i", b"theta_o", b"phi_o"):
        degrees = degrees.replace(name, name + b" [deg]")
    return [
        whole,
        _csv_file(columns="450,550 nm,650"),
        _csv_file(columns="x,y,z", separator=";").replace(b".", b","),
        _csv_file(columns="f", separator="\t"),
        _csv_file(columns="450,550,650", separator=" "),
        degrees.replace(b"\n", b",,\r\n"),
        b"\xef\xbb\xbf" + whole.replace(b"#", b"").rstrip(),
    ]


def _astm_file(value: float = 0.25, count: int = len(_ROWS), columns: str = "R,G,B") -> bytes:
    lines = ["ASTM E1392 style", "SAMPLE Test paint", f"NUM_POINTS {count}"]
    lines.append(f"VARS theta_i,phi_i,theta_s,phi_s,{columns}")
    lines += [",".join(map(str, (*row, 0.1, 0.2, value))) for row in _ROWS]
    return ("\n".join(lines) + "\n").encode()


def _astm_files() -> list[bytes]:
    bands = _astm_file(columns="400nm,500nm,600nm")
    return [_astm_file(), _astm_file(columns="X,Y,Z"), bands.replace(b"VARS", b"VARS =")]


_WORDS = [str(n).encode() for n in (*NUMBERS, *VALUES, 1.5707963, 1.5708, 3.2, -0.5, 89.9, 90)]
_ODD = [b"", b"theta_i", b"550 nm", b"theta_o [deg]", b"isotropic: no", b"1_0", b"0x10", b"name: x"]
_ODD += ["٣".encode(), b"\xff", b"\0", b"9" * 400, b"#", b"\x85", b"\x1c", b"VARS theta_i", b"1,5"]
_ODD += [b"NUM_POINTS 4", b"x", b"R", b"400nm", b"1.5", b'"1"', b";"]


def text_rebuilt(files: Callable[[], list[bytes]]) -> Callable[[bytes, Random], bytes]:
    """Lines of a text in another order, with words of it replaced: of whole files as a rule."""

    def rebuilt(data: bytes, random: Random) -> bytes:
        lines = (data if random.random() < 0.2 else random.choice(files())).split(b"\n")
        words = _WORDS if random.random() < 0.7 else _ODD
        for _ in range(random.choice((1, 1, 1, 2, 4))):
            place = random.randrange(len(lines))
            mark = next((mark for mark in (b";", b"\t", b",") if mark in lines[place]), b" ")
            parts = lines[place].split(mark)
            parts[random.randrange(len(parts))] = random.choice(words)
            lines[place] = mark.join(parts)
            if random.random() < 0.2:
                lines.insert(random.randrange(len(lines)), random.choice(lines))
            if random.random() < 0.1:
                lines[random.randrange(len(lines)) :] = [b""]
        return b"\n".join(lines)

    return rebuilt


SPECIMENS = {
    "Cornell scan": Specimen(
        "paint.brdf",
        lambda: [_cornell_file()],
        header=100,
        sized=lambda count: [_cornell_file(bands=count)],
        valued=lambda value: [_cornell_file(value)],
        rebuild=text_rebuilt(lambda: [_cornell_file()]),
        text=True,
    ),
    "comma-separated samples": Specimen(
        "paint.csv",
        _csv_files,
        header=100,
        sized=lambda count: [b"# samples: %d\n" % count + _csv_file()],
        valued=lambda value: [_csv_file(value), _csv_file(value, "450,550,650", ";")],
        rebuild=text_rebuilt(_csv_files),
        text=True,
    ),
    "ASTM E1392 samples": Specimen(
        "paint.astm",
        _astm_files,
        header=130,
        sized=lambda count: [_astm_file(count=count)],
        valued=lambda value: [_astm_file(value), _astm_file(value, columns="400nm,500nm,600nm")],
        rebuild=text_rebuilt(_astm_files),
        text=True,
    ),
}
