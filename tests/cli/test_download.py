"""`nacre download` against a server on loopback."""

from __future__ import annotations

import os
import pty
import subprocess
import sys

import pytest

import nacre
from tests.cli.test_commands import run
from tests.data import require_data
from tests.download.server import serving
from tests.reflectances import Glossy


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    path = tmp_path_factory.mktemp("table") / "made.bsdf"
    nacre.save(Glossy(0.2, 0.5, 0.3), path)
    return path.read_bytes()


@pytest.fixture
def server(table):
    with serving(table) as server:
        yield server


def download(*arguments, cwd, **environment):
    variables = {"NACRE_CACHE": str(cwd / "cache"), "NACRE_MIRROR": ""} | environment
    return run("download", *arguments, cwd=cwd, quiet=False, **variables)


def test_prints_the_path_and_nothing_else(server, tmp_path):
    arguments = ("rgl", "leaf_maple", "cm_*", "--mirror", server.url)
    done = download(*arguments, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    names = ["leaf_maple", "cm_military_green", "cm_toxic_green", "cm_white"]
    folder = tmp_path / "cache" / "rgl"
    assert done.stdout.splitlines() == [str(folder / f"{name}_rgb.bsdf") for name in names]
    assert done.stderr.count("CC0") == 1
    assert done.stderr.count("downloaded, not verified: no known checksum") == 4
    assert (folder / "leaf_maple_rgb.bsdf").read_bytes() == server.content
    again = download("rgl", "leaf_maple", cwd=tmp_path, NACRE_MIRROR="http://127.0.0.1:9")
    assert again.stdout == f"{folder / 'leaf_maple_rgb.bsdf'}\n"
    assert again.stderr.endswith("leaf_maple: already there, not verified: no known checksum\n")


def test_a_real_file_is_verified_and_loads(server, tmp_path):
    server.content = require_data("rgl", "paper_white_rgb.bsdf").read_bytes()
    server.faults = [("cut", 2**18)]
    options = ("--mirror", server.url, "--accept-terms", "-o", "materials")
    done = download("rgl", "paper_white", *options, cwd=tmp_path)
    assert done.stdout == "materials/paper_white_rgb.bsdf\n"
    assert "paper_white: downloaded, SHA-256 verified" in done.stderr
    assert nacre.load(tmp_path / "materials" / "paper_white_rgb.bsdf").name
    assert len(server.requests) == 2


def test_lists_what_there_is(tmp_path):
    assert "merl" in download(cwd=tmp_path).stdout
    names = download("merl", cwd=tmp_path).stdout.splitlines()
    assert (len(names), names[0]) == (100, "alum-bronze")
    assert "http://btf.utia.cas.cz" in download("utia", cwd=tmp_path).stdout


@pytest.mark.parametrize("chosen", [("chrome",), ("--all",)])
def test_a_script_is_told_how_to_accept_terms_in_one_line(server, tmp_path, chosen):
    done = download("merl", *chosen, "--mirror", server.url, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == (
        "nacre: merl: has terms of use: read them at https://www.merl.com/brdf/ and, if you accept "
        "them, add --accept-terms\n"
    )
    assert not server.requests
    assert not (tmp_path / "cache").exists()


def test_accepted_terms_are_shown(server, tmp_path):
    server.content = bytes(288 * 288 * 3 * 8)
    options = ("--mirror", server.url, "--accept-terms")
    done = download("utia", "m001", "m002", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("passing the files on needs the institute's consent") == 1


def test_what_is_free_of_conditions_asks_nothing(server, tmp_path):
    """The first lines of the README, as a script runs them."""
    server.content = require_data("rgl", "satin_rosaline_rgb.bsdf").read_bytes()
    line = ("rgl", "satin_rosaline", "-o", ".")
    done = download(*line, cwd=tmp_path, NACRE_MIRROR=server.url)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "satin_rosaline_rgb.bsdf\n"
    assert "rgl: CC0, no conditions; rgl-TERMS.txt says what to cite\n" in done.stderr
    assert "Dupuy and Jakob 2018" in (tmp_path / "rgl-TERMS.txt").read_text()


def test_a_file_that_is_there_stays(server, tmp_path):
    mine = tmp_path / "paper_white_rgb.bsdf"
    mine.write_bytes(b"mine")
    done = download("rgl", "paper_white", "-o", ".", "--mirror", server.url, cwd=tmp_path)
    assert done.returncode == 2
    assert "paper_white_rgb.bsdf: exists, and nothing in it says that nacre wrote it" in done.stderr
    assert mine.read_bytes() == b"mine"


def test_offline_is_one_line(tmp_path):
    done = download("rgl", "--all", "--mirror", "http://127.0.0.1:9", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "cannot reach 127.0.0.1: Connection refused" in done.stderr
    assert done.stderr.endswith("; 61 more not tried\n")


@pytest.mark.parametrize(("answer", "code"), [(b"y\n", 0), (b"n\n", 2)])
def test_terms_are_asked_for_at_a_terminal(server, tmp_path, answer, code):
    server.content = bytes(288 * 288 * 3 * 8)
    ours, theirs = pty.openpty()
    os.write(ours, answer)
    done = subprocess.run(
        [sys.executable, "-m", "nacre", "download", "utia", "m001", "--mirror", server.url],
        stdin=theirs,
        capture_output=True,
        text=True,
        timeout=60,
        env=os.environ | {"NACRE_CACHE": str(tmp_path)},
    )
    os.close(ours)
    os.close(theirs)
    assert done.returncode == code, done.stderr
    assert "Do you accept these terms? [y/N]:" in done.stderr
    assert len(server.requests) == (1 if code == 0 else 0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--all",), "expected the name of a database"),
        (("nothing", "x"), "there is no database 'nothing'"),
        (("merl", "--all", "chrome"), "expected either names or --all"),
        (("merl", "crome"), "did you mean chrome"),
        (("merl", "../chrome"), "has no material '../chrome'"),
        (("utia", "m001"), "the address of its files is not known"),
        (("merl", "chrome", "--mirror", "nowhere"), "expected an address like"),
        (("rgl", "cm_white", "--mirror", "http://127.0.0.1:9"), "cannot reach"),
    ],
)
def test_wrong_input_ends_in_one_line(tmp_path, arguments, message):
    done = download(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    line = done.stderr.splitlines()[-1]
    assert line.startswith("nacre: ")
    assert message in line
    assert "Traceback" not in done.stderr
