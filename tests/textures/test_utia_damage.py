"""Folders of images with damaged names and contents: read as textures, or refused in one line."""

from __future__ import annotations

import shutil
from pathlib import Path
from random import Random

import pytest

import nacre
from nacre.errors import FormatError
from tests.reading import check_texture
from tests.specimens.specimen import mutated
from tests.textures.support import pixels, write_image
from tests.tiers import tiered

pytest.importorskip("mitsuba", reason="needs the extra 'render'")

_LETTERS = [*"0019tlpv_. \n", "٣", "\udcff", ".exr", ".PNG", ".jpg", "000", "90", "tv015_pv000"]
_ANGLES = ("000_pl000", "015_pl000", "015_pl180", "075_pl359")


def _renamed(name: str, random: Random) -> str:
    place = random.randrange(len(name))
    return name[:place] + random.choice(_LETTERS) + name[place + random.choice((0, 1, 3)) :]


def _damaged(folder: Path, images: dict[str, bytes], random: Random) -> None:
    """A folder of a few images; one in three names, and one content, is not what it was."""
    ending = random.choice(list(images))
    whole = images[ending]
    view = f"tv{random.choice(_ANGLES)}".replace("pl", "pv")
    place = folder if random.random() < 0.5 else folder / view
    place.mkdir(parents=True, exist_ok=True)
    for angles in random.sample(_ANGLES, 3):
        name = f"tl{angles}_{view}{ending}"
        name = _renamed(name, random) if random.random() < 0.3 else name
        (place / name).write_bytes(whole)
    path = random.choice(sorted(place.iterdir()))
    choice = random.random()
    if choice < 0.5:
        path.write_bytes(mutated(whole, random))
    elif choice < 0.6:
        path.unlink()
        path.mkdir()
    elif choice < 0.7:
        (folder / path.name).write_bytes(whole)


@pytest.mark.parametrize(
    ("rounds", "read", "ways"), tiered([(40, 5, 3), (150, 20, 5)], [(40, 5, 3)])
)
def test_damaged_folders_are_read_or_refused(
    tmp_path: Path, rounds: int, read: int, ways: int
) -> None:
    folder, random = tmp_path / "cloth", Random(0)
    images = {
        ".png": write_image(tmp_path / "x.png", pixels(0)).read_bytes(),
        ".exr": write_image(tmp_path / "x.exr", pixels(0, "f4")).read_bytes(),
    }
    loaded, refused = 0, set()
    for _ in range(rounds):
        _damaged(folder, images, random)
        try:
            check_texture(nacre.load(folder, quantity=random.choice((None, "radiance"))))
            loaded += 1
        except FormatError as error:
            message = str(error)
            assert message.isprintable()
            assert message.startswith(str(folder))
            refused.add(message.rpartition(": ")[2][:12])
        shutil.rmtree(folder)
    assert loaded > read
    assert len(refused) > ways
