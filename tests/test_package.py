"""The face of the package: its names, and where missing libraries send people."""

import ast
import json
import os
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import nacre
from nacre.analytic.lambert import Lambert
from nacre.errors import DISTRIBUTION, MissingExtraError, require

ROOT = Path(__file__).parents[1]
DECLARED = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = DECLARED["project"]


def test_every_public_name_is_there_after_one_import():
    code = "import nacre; print(*[type(getattr(nacre, n)).__name__ for n in nacre.__all__])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert len(done.stdout.split()) == len(nacre.__all__)
    assert {*nacre.__all__, "__doc__"} <= set(dir(nacre))
    assert all(hasattr(nacre, name) for name in dir(nacre))


def test_interfaces_are_attributes_of_the_package():
    done = subprocess.run(
        [sys.executable, "-c", "import nacre; print(nacre.btf.Btf is nacre.Btf)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "True\n"


def test_the_distribution_is_named_as_hints_say():
    assert PROJECT["name"] == DISTRIBUTION
    assert all("nacre[" not in need for need in PROJECT["optional-dependencies"]["all"])
    assert set(PROJECT["scripts"]) == {"nacre", DISTRIBUTION}
    assert len(set(PROJECT["scripts"].values())) == 1


def test_all_is_every_other_extra():
    extras = dict(PROJECT["optional-dependencies"])
    (every,) = extras.pop("all")
    assert Requirement(every).extras == set(extras)


def locked(name: str) -> dict[str, Requirement]:
    """The packages of a lock file by name."""
    lines = (ROOT / "requirements" / f"{name}.lock").read_text().splitlines()
    wanted = [Requirement(line) for line in lines if not line.startswith("#")]
    packages = {canonicalize_name(requirement.name): requirement for requirement in wanted}
    assert len(packages) == len(wanted), name
    return packages


def test_locks_name_one_version_of_all_that_is_declared():
    locks = {name: locked(name) for name in ("demo", "test", "docs", "fuzz")}
    together: dict[str, Requirement] = {}
    for packages in locks.values():
        assert not together.keys() & packages.keys()
        together |= packages
    extras, groups = dict(PROJECT["optional-dependencies"]), DECLARED["dependency-groups"]
    del extras["all"]
    main = (*PROJECT["dependencies"], *extras["render"], *DECLARED["build-system"]["requires"])
    rest = [need for needs in (*extras.values(), *groups.values()) for need in needs]
    for needs, packages in ((main, locks["demo"]), (rest, together)):
        for need in map(Requirement, needs):
            (exact,) = packages[canonicalize_name(need.name)].specifier
            assert exact.operator == "=="
            assert need.specifier.contains(exact.version), need


def test_the_lock_of_the_demo_is_complete():
    """It is installed without a look at what its packages need."""
    packages = locked("demo")
    for name, pinned in packages.items():
        if pinned.marker is not None and not pinned.marker.evaluate():
            continue
        for need in map(Requirement, metadata.requires(name) or []):
            if need.marker is None or need.marker.evaluate({"extra": ""}):
                assert canonicalize_name(need.name) in packages, f"{name}: {need}"


def test_a_missing_library_is_hinted_at_with_the_distribution_and_an_extra_that_brings_it():
    with pytest.raises(MissingExtraError, match=r"pip install 'nacre-materials\[plot\]'"):
        require("no_such_library", "plot")


def required(module: Path) -> list[tuple[str, str]]:
    """The libraries that a module asks for, each with the extra that it names."""
    calls = [
        node
        for node in ast.walk(ast.parse(module.read_text()))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "require"
    ]
    return [
        (call.args[0].value.partition(".")[0], call.args[1].value)
        for call in calls
        if isinstance(call.args[0], ast.Constant)
    ]


def test_extras_that_hints_name_bring_the_library():
    brought_by = {"skimage": "scikit-image", "dask": "distributed"}
    extras = PROJECT["optional-dependencies"]
    sources = (ROOT / "src", ROOT / "lab" / "src")
    asked = {pair for folder in sources for path in folder.rglob("*.py") for pair in required(path)}
    assert len(asked) > 10
    for library, extra in asked:
        name = brought_by.get(library, library)
        assert any(need.startswith(name) for need in extras[extra]), (library, extra)


def test_the_page_on_installing_lists_the_extras_and_what_they_bring():
    page = (ROOT / "docs" / "reference" / "installing.md").read_text()
    table = page.partition("| extra |")[2].partition("\n\n")[0]
    rows = re.findall(r"^\| (.+?) \|$", table, re.M)
    listed = {row.split(" | ")[0].strip("`"): row.split(" | ")[2] for row in rows}
    extras = PROJECT["optional-dependencies"]
    assert list(listed) == ["none", *extras]
    for name, needs in extras.items():
        brought = {Requirement(need).name for need in needs if name != "all"}
        assert brought == set(re.findall(r"`([A-Za-z-]+)`", listed[name])), name
    always = {Requirement(need).name for need in PROJECT["dependencies"]}
    assert set(re.findall(r"`(\w+)`", listed["none"])) <= always


def test_the_conda_recipe_needs_what_the_package_needs():
    recipe = yaml.safe_load((ROOT / "packaging" / "recipe.yaml").read_text())
    minimum = recipe["context"]["python_min"]
    assert PROJECT["requires-python"] == f">={minimum}"
    assert recipe["context"]["version"] == PROJECT["version"]
    needed = recipe["requirements"]["run"]
    assert needed[0] == "python >=${{ python_min }}"
    assert sorted(need.replace(" ", "") for need in needed[1:]) == sorted(PROJECT["dependencies"])
    (backend,) = DECLARED["build-system"]["requires"]
    assert backend in [need.replace(" ", "") for need in recipe["requirements"]["host"]]
    points = [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert recipe["build"]["python"]["entry_points"] == points


def test_an_address_makes_the_links_of_a_page_absolute(monkeypatch: pytest.MonkeyPatch):
    release = runpy.run_path(str(ROOT / "scripts" / "release.py"))["absolute_links"]
    page = "[a](docs/x.md#part) ![b](../c.jpg) [d](https://example.org) [e](#here)"
    assert release(page, Path("lab")) == page
    declared = {"version": "1.2.3", "urls": {"Source": "https://example.org/nacre"}}
    package = release.__globals__["Package"]
    monkeypatch.setattr(package, "declared", property(lambda _: declared))
    assert release(page, Path("lab")) == (
        "[a](https://example.org/nacre/blob/v1.2.3/lab/docs/x.md#part) "
        "![b](https://example.org/nacre/raw/v1.2.3/c.jpg) [d](https://example.org) [e](#here)"
    )


@pytest.mark.parametrize("linked", [True, False])
def test_the_environment_of_another_checkout_is_refused(tmp_path: Path, linked: bool) -> None:
    owner, checkout = tmp_path / "owner with a space", tmp_path / "checkout"
    environment = (owner if linked else checkout) / ".venv"
    facts = environment / "lib/python3.11/site-packages/nacre_materials-0.2.0.dist-info"
    for folder in (facts, environment / "bin", checkout / "scripts"):
        folder.mkdir(parents=True)
    (environment / "bin/python").touch()
    record = {"dir_info": {"editable": True}, "url": owner.as_uri()}
    (facts / "direct_url.json").write_text(json.dumps(record))
    if linked:
        (checkout / ".venv").symlink_to(environment)
    shutil.copy(ROOT / "scripts/setup.py", checkout / "scripts")
    before = sorted(environment.rglob("*"))
    done = subprocess.run(
        [sys.executable, checkout / "scripts/setup.py"], capture_output=True, text=True
    )
    assert done.returncode == 1
    place = checkout / ".venv"
    expected = f"setup: {place} was set up for {owner}: remove it or the link, then run this again"
    assert done.stderr.splitlines() == [expected]
    assert sorted(environment.rglob("*")) == before


def test_the_container_installs_what_rendering_needs_and_is_not_root():
    recipe = (ROOT / "packaging" / "container" / "Containerfile").read_text()
    setup = (ROOT / "scripts" / "setup.py").read_text()
    for package in ("libllvm19", "libatomic1"):
        assert package in recipe
        assert f'apt("{package}")' in setup
    assert "nacre_materials-*.whl)[render]" in recipe
    assert recipe.index("USER 1000") > recipe.rindex("RUN ")
    assert recipe.rstrip().endswith('ENTRYPOINT ["nacre"]')


def command(*words: str, code: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process of its own, after some code."""
    program = f"from nacre.cli import main, root\n{code}\nmain({list(words)})"
    return subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )


ALONE = "root._commands._entry_points = {}"
"""As where no other package is installed."""


@pytest.mark.parametrize("name", ["bench", "reproduce"])
def test_commands_of_the_lab_say_what_to_install(name: str) -> None:
    done = command(name, "--list", code=ALONE)
    assert done.returncode == 2
    assert done.stderr == f"nacre: {name!r} comes with nacre-lab: pip install nacre-lab\n"
    assert name not in command("--help", code=ALONE).stdout.split()


@pytest.fixture
def plugins(tmp_path: Path) -> dict[str, str]:
    """An environment with a package that adds a command, and one that does not load."""
    (tmp_path / "greeting.py").write_text(
        "import click\n@click.command('greet', help='Greet people.')\n"
        "def greet() -> None:\n    click.echo('hello')\n"
    )
    facts = tmp_path / "greeting-1.0.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: greeting\nVersion: 1.0\n")
    (facts / "entry_points.txt").write_text(
        "[nacre.commands]\ngreet = greeting:greet\nbroken = greeting:nothing\n"
    )
    folders = str(tmp_path), os.environ.get("PYTHONPATH", "")
    return {"PYTHONPATH": os.pathsep.join(filter(None, folders))}


def test_other_packages_add_commands(plugins: dict[str, str]) -> None:
    assert command("greet", **plugins).stdout == "hello\n"
    listed = command("--help", **plugins).stdout
    assert "\nFrom greeting:\n" in listed
    assert "Greet people." in listed
    assert "of the package greeting does not load" in " ".join(listed.split())


def test_a_command_that_does_not_load_is_an_error_in_one_line(plugins: dict[str, str]) -> None:
    done = command("broken", **plugins)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "'broken' of the package greeting does not load" in done.stderr


@pytest.mark.parametrize(("typed", "meant"), [("gret", "greet"), ("rendre", "render")])
def test_commands_of_all_packages_are_suggested(
    plugins: dict[str, str], typed: str, meant: str
) -> None:
    done = command(typed, **plugins)
    assert done.returncode == 2
    assert f"did you mean nacre {meant}?" in done.stderr


def test_texture_networks_name_their_own_extra_for_pytorch():
    code = """
import sys
sys.modules["torch"] = None
import nacre.textures.codecs.networks.training
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "pip install 'nacre-materials[btf]'" in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="needs address space limits that hold")
def test_too_little_memory_is_a_line_wherever_it_shows(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource", reason="needs limits of a process")
    nacre.save(Lambert(diffuse=(0.5, 0.5, 0.5)), tmp_path / "gray.json")
    quick = ("--epochs", "1", "--samples", "2000", "-o", tmp_path / "x.safetensors")
    for size in (300 << 20, 400 << 20, 500 << 20):
        done = subprocess.run(
            [sys.executable, "-m", "nacre", "-q", "fit", tmp_path / "gray.json", *quick],
            preexec_fn=lambda size=size: resource.setrlimit(resource.RLIMIT_AS, (size, size)),
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )
        assert (done.returncode, done.stderr.count("\n")) in ((2, 1), (0, 0)), done.stderr
        assert done.returncode == 0 or "memory" in done.stderr
