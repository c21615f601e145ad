"""Small scans as text: Cornell files, separated values and ASTM E1392 files."""

from __future__ import annotations

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


def _text_rebuilt(data: bytes, random: Random) -> bytes:
    """Lines of a text in another order, with words of it replaced."""
    words = [str(n).encode() for n in (*NUMBERS, *VALUES)]
    words += [b"", b"theta_i", b"550 nm", b"theta_o [deg]", b"isotropic: no", b"1_0", b"0x10"]
    words += ["٣".encode(), b"\xff", b"\0", b"9" * 400, b"#", b"\x85", b"\x1c", b"name: x"]
    words += [b"VARS theta_i", b"NUM_POINTS 4", b"x", b"R", b"400nm", b"1,5", b"1.5", b'"1"', b";"]
    lines = data.split(b"\n")
    for _ in range(random.randint(1, 4)):
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


SPECIMENS = {
    "Cornell scan": Specimen(
        "paint.brdf",
        lambda: [_cornell_file()],
        header=100,
        sized=lambda count: [_cornell_file(bands=count)],
        valued=lambda value: [_cornell_file(value)],
        rebuild=_text_rebuilt,
        text=True,
        module="colour",
    ),
    "comma-separated samples": Specimen(
        "paint.csv",
        _csv_files,
        header=100,
        sized=lambda count: [b"# samples: %d\n" % count + _csv_file()],
        valued=lambda value: [_csv_file(value), _csv_file(value, "450,550,650", ";")],
        rebuild=_text_rebuilt,
        text=True,
        module="colour",
    ),
    "ASTM E1392 samples": Specimen(
        "paint.astm",
        lambda: [
            _astm_file(),
            _astm_file(columns="X,Y,Z"),
            _astm_file(columns="400nm,500nm,600nm").replace(b"VARS", b"VARS ="),
        ],
        header=130,
        sized=lambda count: [_astm_file(count=count)],
        valued=lambda value: [_astm_file(value), _astm_file(value, columns="400nm,500nm,600nm")],
        rebuild=_text_rebuilt,
        text=True,
        module="colour",
    ),
}
