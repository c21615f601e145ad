from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nacre.download import Facts, databases, find
from nacre.errors import NacreError
from tests.data import require_data


def test_merl_is_the_fact_sheet():
    sheet = require_data("merl-sha256.txt").read_text().splitlines()
    expected = {
        name.removesuffix(".binary"): Facts(sha256, int(size))
        for sha256, size, name in map(str.split, sheet)
    }
    assert find("merl").materials == expected
    assert len(expected) == 100


def test_tables_are_of_plain_names_and_whole_checksums():
    for database in databases().values():
        for name, facts in database.materials.items():
            assert re.fullmatch(r"[a-z0-9_-]+", name)
            assert facts.sha256 is None or re.fullmatch(r"[0-9a-f]{64}", facts.sha256)
            assert facts.size is None or 0 < facts.size <= database.limit
        assert "https://" in database.terms or "http://" in database.terms


def test_addresses():
    assert find("merl").address("chrome") == (
        "http://people.csail.mit.edu/wojciech/BRDFDatabase/brdfs/chrome.binary"
    )
    folder = "https://d38rqfq1h7iukm.cloudfront.net/media/materials/cm_white/cm_white"
    assert find("rgl").address("cm_white") == f"{folder}_rgb.bsdf"
    assert find("rgl-spectral").address("cm_white") == f"{folder}_spec.bsdf"
    mirrored = find("utia").address("m001", "http://host/a/")
    assert mirrored == "http://host/a/utia/m001.bin"


def test_a_database_without_addresses_wants_a_mirror():
    with pytest.raises(NacreError, match=r"btf\.utia\.cas\.cz.*NACRE_MIRROR.* utia/m001\.bin$"):
        find("utia").address("m001")


@pytest.mark.parametrize(
    "mirror", ["", "host", "ftp://host", "file:///etc", "https://", "http://["]
)
def test_mirrors_that_are_none(mirror):
    with pytest.raises(NacreError, match="expected an address like"):
        find("merl").address("chrome", mirror)


def test_unknown_names():
    with pytest.raises(NacreError, match="did you mean gold-metallic-paint,"):
        find("merl").facts("gold-metalic-paint")
    with pytest.raises(NacreError, match="'nacre download rgl' lists them"):
        find("rgl").facts("zzz")
    with pytest.raises(NacreError, match=r"names are at http://btf"):
        find("utia").facts("a b")
    with pytest.raises(NacreError, match=r"expected one of merl, rgl, rgl-spectral, utia"):
        find("nothing")


@pytest.mark.parametrize("name", ["../x", "/etc/passwd", "a/b", "a\\b", "..", "", ".x", "a\n", "é"])
@pytest.mark.parametrize("database", ["merl", "utia"])
def test_no_name_leads_out_of_the_folder(name, database):
    with pytest.raises(NacreError):
        find(database).file_name(name)


@given(st.text(max_size=20))
def test_whatever_name_passes_is_a_plain_one(name):
    for database in databases().values():
        try:
            file_name = database.file_name(name)
        except NacreError:
            continue
        assert re.fullmatch(r"[A-Za-z0-9_-]+(_rgb|_spec)?\.[a-z]+", file_name)


def test_patterns():
    merl = find("merl")
    assert merl.select(["gold-*", "chrome", "gold-paint"]) == [
        "gold-metallic-paint",
        "gold-metallic-paint2",
        "gold-metallic-paint3",
        "gold-paint",
        "chrome",
    ]
    assert len(merl.select(["*"])) == 100
    for pattern in ("x*", "../*", "[z"):
        with pytest.raises(NacreError, match="no material matches"):
            merl.select([pattern])
    with pytest.raises(NacreError, match="no material matches"):
        find("utia").select(["*"])
