"""What a result's fingerprint counts, on a package written here, and on nacre itself."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
import textwrap
from functools import partial
from pathlib import Path

import pytest

import nacre
from nacre.analytic import MODELS
from nacre.formats import FORMATS
from nacre.latent.file import BASES
from nacre.runtime import code_fingerprint as module
from nacre.runtime.code_fingerprint import code_fingerprint, place_of
from nacre.textures.codecs.codec import CODECS

PACKAGE = {
    "__init__": """
        from typing import TYPE_CHECKING
        import lazy_loader
        if TYPE_CHECKING:
            from shop.till import total
        __getattr__, __dir__, _ = lazy_loader.attach(__name__, submod_attrs={"till": ["total"]})
        """,
    "till": '''
        """Sums."""
        import math
        from typing import TYPE_CHECKING
        import shop.taxes
        from . import rules
        if TYPE_CHECKING:
            from shop.goods import Thing
        RATE = 0.2
        def total(things: list[Thing]) -> float:
            """What things cost."""
            from shop.goods import price as cost
            return shop.taxes.with_tax(sum(map(cost, things)), RATE) * rules.FACTOR
        def unused():
            return math.inf
        ''',
    "taxes": "def with_tax(value, rate):\n    return value * (1.0 + rate)\ndef other(): ...\n",
    "rules": "FACTOR = 1\nTABLE = {}\nTABLE['a'] = FACTOR\nprint\nUNUSED = 2\n",
    "goods": """
        from shop.registry import KINDS
        class Base:
            weight = 1.0
        class Thing(Base):
            price = 2.0
        def price(thing):
            return KINDS[thing].price
        """,
    "registry": "KINDS = dict(box='shop.boxes:Box')\nMORE = dict(bag='shop.boxes:Bag')\n",
    "boxes": "class Box:\n    price = 3.0\nclass Bag:\n    price = 4.0\n",
}


@pytest.fixture
def shop(tmp_path, monkeypatch):
    folder = tmp_path / "shop"
    folder.mkdir()
    for name, text in PACKAGE.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(text))
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("shop")
    yield folder
    sys.modules.pop("shop")
    forget()


def forget():
    module._fingerprint.cache_clear()


def replaced(folder: Path, name: str, old: str, new: str, root: str) -> tuple[str, str]:
    """Fingerprints before and after a change of a file."""
    found = []
    path = folder / f"{name}.py"
    text = path.read_text()
    assert old in text
    for content in (text, text.replace(old, new)):
        path.write_text(content)
        forget()
        found.append(code_fingerprint(root))
    path.write_text(text)
    forget()
    return found[0], found[1]


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("till", "RATE = 0.2", "RATE = 0.3"),
        ("till", "from . import rules", "from . import taxes as rules"),
        ("taxes", "1.0 + rate", "1.0 - rate"),
        ("rules", "FACTOR = 1", "FACTOR = True"),
        ("rules", "print", "print(FACTOR)"),
        ("goods", ".price", ".weight"),
        ("registry", "shop.boxes:Box", "shop.boxes:Bag"),
        ("boxes", "3.0", "5.0"),
        ("__init__", "import lazy_loader", "import lazy_loader\nprint('imported')"),
    ],
)
def test_what_a_function_reaches_counts(shop, name, old, new):
    before, after = replaced(shop, name, old, new, "shop.till:total")
    assert before != after


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("till", "math.inf", "math.nan"),
        ("till", '"""What things cost."""', "# a comment"),
        ("till", "list[Thing]) -> float", "list[Base]) -> int"),
        ("till", "sum(map(cost, things)), RATE)", "(sum(map(cost,\n\n  things))), RATE)"),
        ("taxes", "def other(): ...", "def other(): return 1"),
        ("rules", "UNUSED = 2", "UNUSED = 3"),
        ("goods", "class Thing(Base)", "class Thing"),
        ("registry", "shop.boxes:Bag", "shop.boxes:Box"),
        ("boxes", "4.0", "5.0"),
    ],
)
def test_nothing_else_counts(shop, name, old, new):
    before, after = replaced(shop, name, old, new, "shop.till:total")
    assert before == after


def test_names_that_a_package_gives_when_they_are_asked_for_are_followed(shop):
    assert code_fingerprint("shop:total") != code_fingerprint("shop.till:unused")
    before, after = replaced(shop, "boxes", "3.0", "5.0", "shop:total")
    assert before != after


def test_what_has_no_source_is_refused(shop):
    for root in ("shop.none", "shop.till:none", "absent:x", "sys:path"):
        with pytest.raises(ValueError, match="no source"):
            code_fingerprint(root)


def test_places(shop):
    from shop import goods

    assert place_of(goods.price) == place_of(partial(goods.price, 1)) == "shop.goods:price"
    assert place_of(goods.Thing) == place_of(goods.Thing()) == "shop.goods:Thing"
    assert place_of(lambda: None) == __name__ + ":test_places"
    assert place_of(nacre.Recipe.preset) == "nacre.neural.recipe:Recipe"


@pytest.mark.slow
def test_members_of_registries_are_reached():
    """What a registry imports by a text is followed, or a fingerprint would miss it in silence."""
    search = module._Search({"nacre"})
    for place, registry in (
        ("nacre.formats:FORMATS", FORMATS),
        ("nacre.analytic:MODELS", MODELS),
        ("nacre.textures.codecs.codec:CODECS", CODECS),
        ("nacre.latent.file:BASES", BASES),
    ):
        search.reach(module._Target(*place.split(":")))
        assert registry._places
        for member in registry._places.values():
            assert module._Target(*member.split(":")) in search._seen


@pytest.mark.slow
def test_what_a_fit_calls_is_counted(tmp_path):
    """Against what Python says that runs."""
    script = f"""
        import sys, threading
        called = set()
        def note(frame, event, _):
            code = frame.f_code
            if event == "call" and code.co_flags & 1 and code.co_filename.endswith(".py"):
                called.add((frame.f_globals.get("__name__"), code.co_qualname.split(".")[0]))
        import nacre
        from nacre.measured import merl
        from nacre.neural import file as neural_file
        from tests.scans import Gloss
        path, recipe = {str(tmp_path / "a.binary")!r}, nacre.Recipe(hidden=(4,), samples=1000)
        merl.save(Gloss(), path, merl.Resolution(6, 4, 4))
        sys.setprofile(note); threading.setprofile(note)
        neural_file.encode(nacre.fit(merl.load(path), recipe))
        sys.setprofile(None)
        print(*(f"{{m}}:{{n}}" for m, n in called if str(m).startswith("nacre.")))
    """
    path = tmp_path / "fit.py"
    path.write_text(textwrap.dedent(script))
    root = Path(__file__).parents[2]
    paths = os.pathsep.join([str(root / "src"), str(root)])
    environment = {**os.environ, "PYTHONPATH": paths}
    done = subprocess.run(
        [sys.executable, path], env=environment, capture_output=True, text=True, check=True
    )
    search = module._Search({"nacre"})
    for place in ("nacre.measured.merl:load", "nacre:fit", "nacre.neural.file:encode"):
        search.reach(module._Target(*place.split(":")))
    counted = {line.split(" ")[0] for line in search.found}
    called = {name for name in done.stdout.split() if "<" not in name}
    assert {"nacre.neural.kernel:KernelTrainer", "nacre.measured.merl_table:MerlBrdf"} <= called
    assert called - counted == set()


@pytest.mark.slow
def test_it_is_the_same_in_a_copy_and_after_a_new_version(tmp_path, monkeypatch):
    root = "nacre.neural:fit"
    before = code_fingerprint(root)
    source = Path(nacre.__file__).parent
    copy = tmp_path / "nacre"
    shutil.copytree(source, copy, ignore=shutil.ignore_patterns("*.safetensors", "*.pyc"))
    text = (copy / "__init__.py").read_text()
    (copy / "__init__.py").write_text(text.replace('__version__ = "', '__version__ = "9'))
    monkeypatch.setattr(nacre, "__file__", str(copy / "__init__.py"))
    forget()
    assert code_fingerprint(root) == before
    for name, same in (("mitsuba/network.py", True), ("neural/kernel_code.py", False)):
        with (copy / name).open("a") as file:
            file.write("\nfrom math import nan as _exp\n")
        forget()
        assert (code_fingerprint(root) == before) is same
    monkeypatch.undo()
    forget()
