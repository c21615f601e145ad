"""The command line as a user meets it: real files, and real processes where those differ."""

from __future__ import annotations

import os
import re
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.neural import Layer, NeuralBrdf
from tests.cli.support import assert_refused
from tests.cli.support import run as run_here
from tests.scans import Gloss, scan
from tests.tiers import tiered

TIMEOUT = 240


def run(
    *arguments: object, cwd: Path, quiet: bool = True, **environment: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "nacre", *(["-q"] if quiet else []), *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        env=os.environ | environment,
    )


@pytest.fixture
def command(capsys, monkeypatch):
    """Runs a command like `run`, but in this process, which need not load what commands do."""

    def call(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
        monkeypatch.chdir(cwd)
        capsys.readouterr()
        code = run_here(*arguments)
        return subprocess.CompletedProcess(arguments, code, *capsys.readouterr())

    return call


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small measured table and the neural material that `nacre fit` makes of it."""
    folder = tmp_path_factory.mktemp("materials")
    random = np.random.default_rng(0)
    layers = [
        Layer(random.normal(0, 0.5, (6, 8)).astype(np.float32), np.zeros(8, np.float32)),
        Layer(random.normal(0, 0.5, (8, 3)).astype(np.float32), np.full(3, 0.2, np.float32)),
    ]
    nacre.save(NeuralBrdf(layers), folder / "table.binary")
    nacre.save(NeuralBrdf(layers), folder / "turned.bin")
    done = run("fit", "table.binary", "--epochs", 2, "--samples", 20000, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "675 weights of 1,350 bytes" in done.stdout
    assert re.search(r"^  PSNR \S+ dB on a sphere in directional light: ", done.stdout, re.M)
    assert "nacre compare table.binary table.safetensors" in done.stdout
    shutil.copy(folder / "table.safetensors", folder / "x_neural.safetensors")
    return folder


def test_fit_writes_a_material_that_loads(folder):
    material = nacre.load(folder / "table.safetensors")
    assert material.weight_count == 675
    assert material.metadata["source"]["file"] == "table.binary"


def test_fit_takes_sizes_seeds_and_names(command, folder, tmp_path):
    options = ["--hidden", "8", "--seed", 3, "--epochs", 1, "--samples", 2000]
    for name in "ab":
        done = command(
            "fit",
            folder / "table.binary",
            "-o",
            tmp_path / f"{name}.safetensors",
            *options,
            cwd=tmp_path,
        )
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.safetensors").read_bytes() == (tmp_path / "b.safetensors").read_bytes()
    assert nacre.load(tmp_path / "a.safetensors").sizes == (6, 8, 3)


def test_fit_takes_bytes_and_a_precision(command, folder, tmp_path):
    options = ["--max-bytes", 900, "--epochs", 1, "--samples", 2000, "--precision", "half"]
    done = command("fit", folder / "table.binary", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    material = nacre.load(tmp_path / "table.safetensors")
    assert material.precision == "half"
    assert 800 < material.nbytes <= 900
    assert f"{material.weight_count} weights of {material.nbytes} bytes" in done.stdout


def test_the_fit_of_a_scan_ends_in_its_error_at_held_out_samples(command, tmp_path):
    nacre.save(scan(Gloss(), 300), tmp_path / "scan.csv")
    done = command("fit", "scan.csv", "--epochs", 20, "--samples", 8000, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    error = r"median \d+\.\d %, mean \d+\.\d %"
    line = rf"at 60 held-out samples: {error} \(of the nearest sample: {error}\)"
    assert re.search(line, " ".join(done.stdout.split()))
    assert "held out median error" in command("info", "-v", "scan.safetensors", cwd=tmp_path).stdout


def test_several_files_fit_into_a_folder(command, folder, tmp_path):
    (tmp_path / "other.binary").write_bytes((folder / "table.binary").read_bytes())
    options = ["--epochs", 1, "--samples", 2000, "-o", tmp_path]
    done = command("fit", folder / "table.binary", "other.binary", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert {p.name for p in tmp_path.glob("*.safetensors")} == {
        "table.safetensors",
        "other.safetensors",
    }


def test_a_bad_file_among_several_does_not_stop_the_others(command, folder, tmp_path):
    (tmp_path / "bad.binary").write_bytes(b"bad")
    arguments = ["bad.binary", folder / "table.binary", "--epochs", 1, "--samples", 2000]
    done = command("fit", *arguments, cwd=tmp_path)
    assert done.returncode == 1
    assert "bad.binary: is of no known format" in done.stderr
    assert "675 weights" in done.stdout
    assert {p.name for p in tmp_path.glob("*.safetensors")} == {"table.safetensors"}


def test_info_shows_facts_line_by_line(command, folder):
    done = command("info", "-v", "table.binary", "table.safetensors", cwd=folder)
    assert done.returncode == 0, done.stderr
    for words in ("90 x 90 x 180", "invalid samples", "6-21-21-3", "held out loss", "GGX normals"):
        assert words in done.stdout


def test_render_writes_a_picture(folder, tmp_path):
    options = ["--size", 24, "--height", 16, "--spp", 2, "--shape", "sphere"]
    for name in ("x.png", "x.exr"):
        done = run(
            "render", folder / "table.safetensors", "-o", tmp_path / name, *options, cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
        assert (tmp_path / name).stat().st_size > 100
    assert len(list(tmp_path.iterdir())) == 2


def test_compare_prints_numbers_and_writes_a_picture(folder, tmp_path):
    arguments = [folder / "table.binary", folder / "table.safetensors", "-o", "x.png", "--size", 32]
    done = run("compare", *arguments, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for words in ("SSIM", "PSNR", "FLIP", "log-cosine error", "environment", "directional"):
        assert words in done.stdout
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_convert_goes_from_any_format_to_any_it_can(folder, tmp_path):
    wi = np.array([0.0, 0.0, 1.0])
    options = ["--inputs", "paper", "--epochs", 1, "--samples", 2000]
    source = tmp_path / "paper.safetensors"
    done = run("fit", folder / "table.binary", "-o", source, *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    expected = nacre.load(source).eval(wi, wi)
    for name in ("x.h5", "x.bsdf", "x.binary", "x.csv"):
        done = run("convert", source, "-o", name, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        size = f"{(tmp_path / name).stat().st_size:,} bytes"
        lost = r"f_r within \S+ % in the median, " if name in ("x.bsdf", "x.binary") else ""
        assert re.fullmatch(f"{re.escape(name)}: {lost}{size}\n", done.stdout)
        found = nacre.load(tmp_path / name).eval(wi, wi)
        np.testing.assert_allclose(found, expected, rtol=0.02, atol=1e-6)
        source = name
    done = run("convert", "x.binary", "-o", "y.bsdf", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = nacre.load(tmp_path / "y.bsdf").eval(wi, wi)
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=1e-6)


def test_convert_takes_a_resolution(command, folder, tmp_path):
    for name, nodes, grid in (
        ("x.binary", "9,8,10", "theta_h x theta_d x phi_d: 9 x 8 x 10"),
        ("x.bsdf", "1,6,10,8,16", "vndf 8 x 16; rgb 10 x 10"),
    ):
        source = folder / "table.binary"
        done = command("convert", source, "-o", name, "--resolution", nodes, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert grid in nacre.load(tmp_path / name).describe()["grid"]


@pytest.mark.slow
@pytest.mark.parametrize("given", tiered(["", "file"], ["file"]))
def test_demo_runs_the_main_job(folder, tmp_path, given):
    named = str(folder / "table.binary") if given else ""
    options = ["--preset", "draft", "--spp", 2, "-o", "made/demo.png"]
    done = run("demo", *options, cwd=tmp_path, NACRE_DATA=named)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "made/demo.png").stat().st_size > 10_000
    assert nacre.load(tmp_path / "made/demo_neural.safetensors").weight_count == 675
    assert (tmp_path / "made/demo_measured.npz").exists() == (given == "")


def test_demo_takes_the_first_table_of_a_folder(tmp_path):
    for name in ("b.bsdf", "a.bsdf"):
        (tmp_path / name).write_bytes(b"no table")
    done = run("demo", cwd=tmp_path, NACRE_DATA=str(tmp_path))
    assert done.returncode != 0
    assert "a.bsdf: " in done.stderr


def damaged_files(folder: Path, target: Path) -> dict[str, Path]:
    whole = (folder / "table.binary").read_bytes()
    neural = (folder / "table.safetensors").read_bytes()
    contents = {
        "empty.binary": b"",
        "short.binary": whole[:-8],
        "header.binary": whole[:7],
        "long.binary": whole + b"x",
        "absurd.binary": struct.pack("<3i", 2**31 - 1, 1, 1) + whole[12:],
        "zero.binary": struct.pack("<3i", 0, 90, 180) + whole[12:],
        "negative.binary": struct.pack("<3i", -90, 90, 180) + whole[12:],
        "nan.binary": whole[:12] + struct.pack("<d", float("nan")) + whole[20:],
        "magic.bsdf": b"tensor_fool\0" + bytes(50),
        "short.bsdf": b"tensor_file\0\1\0\7\0\0\0",
        "short.safetensors": neural[:-1],
        "text.safetensors": b"not a material",
        "text.h5": b"\x89HDF\r\n\x1a\n" + bytes(20),
    }
    for name, content in contents.items():
        (target / name).write_bytes(content)
    paths = {name: target / name for name in contents}
    return paths | {"absent": target / "absent.binary", "directory": target}


def test_bad_files_give_one_line_and_exit_code_2(folder, tmp_path):
    """In one process, to be quick; the next test checks a real one."""
    from click.testing import CliRunner

    from nacre.cli import main

    for name, path in damaged_files(folder, tmp_path).items():
        for arguments in (
            ["info", path],
            ["fit", path, "-o", tmp_path / "out.safetensors"],
            ["render", path, "-o", tmp_path / "out.png"],
            ["compare", path, folder / "table.safetensors", "-o", tmp_path / "out.png"],
        ):
            error = None
            with CliRunner().isolation() as streams:
                try:
                    main([str(a) for a in arguments])
                except SystemExit as stop:
                    error = stop
                text = streams[1].getvalue().decode()
            assert error is not None, (name, arguments)
            assert error.code == 2, (name, arguments)
            lines = [line for line in text.splitlines() if "nacre:" in line]
            assert len(lines) == 1, (name, text)
            assert str(path) in lines[0]
            assert "Traceback" not in text
    assert not list(tmp_path.glob("*out*"))


def test_a_bad_file_gives_no_traceback(folder, tmp_path):
    path = damaged_files(folder, tmp_path)["short.binary"]
    done = run("fit", path, "-o", "out.safetensors", cwd=tmp_path)
    assert done.returncode == 2
    assert "the file is cut short" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out.safetensors").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fit", "table.binary", "-o", "missing/x.safetensors"], "does not exist; create it"),
        (["fit", "table.binary", "-o", "x.txt"], "no format to write ends in '.txt'"),
        (["fit", "table.binary", "--hidden", "21,x"], "expected whole numbers"),
        (
            ["fit", "table.binary", "--epochs", "0"],
            "nacre: --epochs: expected 1 or more, got 0 (see nacre fit --help)",
        ),
        (
            ["fit", "table.binary", "--max-bytes", "63"],
            "--max-bytes: expected 64 to 1,048,576, got 63",
        ),
        (["fit", "table.binary", "--max-bytes", "900", "--hidden", "9"], "exclude each other"),
        (
            ["fit", "table.binary", "--model", "ggx", "--max-bytes", "900"],
            "--max-bytes is for networks; ggx is an analytic model",
        ),
        (
            ["fit", "table.binary", "-o", "fitted"],
            "fitted: has no ending; write fitted.safetensors",
        ),
        (["fit", "table.binary", "-o", "-"], "only one analytic model"),
        (["fit", "table.binary", "--codec", "basis"], "--codec is for textures (BTFs)"),
        (["render", "table.binary", "--frames", "3"], "--frames is for textures (BTFs)"),
        (
            ["render", "table.binary", "--shape", "cylinder"],
            "; expected one of ball, sphere",
        ),
        (["render", "table.binary", "-o", "-"], "binary files cannot go to standard output"),
        (["convert", "table.binary", "x.bsdf"], "type: nacre convert table.binary -o x.bsdf"),
        (["fit", "table.binary", "--device", "abacus"], "abacus"),
        (["fit", "table.binary", "table.binary"], "same name"),
        (["fit", "table.binary", "turned.bin", "-o", "x.safetensors"], "must be a folder"),
        (["fit", "table.safetensors"], "table.safetensors: is the input as well"),
        (["demo", "x_neural.safetensors", "-o", "x.png"], "is the input as well"),
        (["fit"], "type: nacre fit INPUT..."),
        (["convert", "table.binary", "-o", "table.binary"], "is the input as well"),
        (["convert", "table.binary", "-o", "x.safetensors"], "fit the material first"),
        (["convert", "table.binary", "-o", "x.txt"], "no format to write ends in '.txt'"),
        (["convert", "turned.bin", "-o", "x.binary"], "turned is anisotropic"),
        (
            ["convert", "table.binary", "-o", "x.binary", "--resolution", "9,8"],
            "expected theta_h,theta_d",
        ),
        (
            ["convert", "table.binary", "-o", "x.binary", "--resolution", "a"],
            "expected whole numbers",
        ),
        (
            ["convert", "table.binary", "-o", "x.binary", "--resolution", "9,8,"],
            "expected whole numbers",
        ),
        (
            ["convert", "table.binary", "-o", "x.bsdf", "--resolution", "1,9,9,99,99"],
            "at most 8192",
        ),
        (["convert", "table.binary", "-o", "x.bin", "--resolution", "6,48"], "is fixed"),
        (["fit", "turned.bin", "-o", "x.h5"], "hold isotropic reflectance only"),
        (["convert", "absent.binary", "-o", "x.bsdf"], "absent.binary: no such file"),
        (["render", "table.binary", "-o", "x.gif"], "ends in one of .exr"),
        (["render", "table.binary", "--shape", "teapot"], "'teapot' is not one of"),
        (["render", "table.binary", "--environment", "sky.exr"], "sky.exr"),
        (["compare", "table.binary"], "type: nacre compare REFERENCE OTHER"),
        (["compare", "table.binary", "table.binary", "-o", "x.exr"], "ends in one of .png, .jpg"),
        (["frobnicate"], "no command 'frobnicate' (see nacre --help)"),
        (["rendre"], "did you mean nacre render?"),
        (["btf", "plam"], "did you mean nacre btf plan?"),
        (["help", "fit", "x"], "nacre fit has no commands of its own"),
        (["--wrong"], "no option --wrong (see nacre --help)"),
        (
            ["fit", "table.binary", "--presett", "draft"],
            "no option --presett; did you mean --preset?",
        ),
    ],
)
def test_wrong_usage_says_so_and_exits_with_2(folder, arguments, words, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    assert_refused(capsys, words, *arguments)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder nobody can write to")
def test_an_unwritable_folder_is_found_before_the_work(folder):
    done = run("fit", "table.binary", "-o", "/proc/self/x.safetensors", cwd=folder)
    assert done.returncode == 2
    assert "/proc/self/x.safetensors: cannot be written" in done.stderr
    assert "training" not in done.stderr


@pytest.mark.slow
def test_a_missing_extra_is_named(folder):
    hide = (
        "import sys; sys.modules.update(dict.fromkeys(['mitsuba', 'torch', 'skimage']));"
        "from nacre.cli import main; main(sys.argv[1:])"
    )
    for arguments, extra in (
        (["render", "table.binary"], "nacre-materials[render]"),
        (["compare", "table.binary", "table.binary"], "nacre-materials[render]"),
        (["fit", "table.binary", "--device", "cpu", "--samples", "1000"], "nacre-materials[torch]"),
    ):
        done = subprocess.run(
            [sys.executable, "-c", hide, *arguments],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
        )
        assert done.returncode == 2, done.stderr
        assert extra in done.stderr
        assert "Traceback" not in done.stderr


def test_help_lists_every_command_and_heavy_libraries_stay_out():
    code = (
        "import sys, nacre, nacre.cli\n"
        "try: nacre.cli.main(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'numba', 'torch', 'mitsuba', 'drjit', 'skimage', 'h5py', 'numpy', 'rich'}\n"
        "heavy.add('matplotlib')\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    for name in ("compare", "convert", "demo", "fit", "info", "measure", "plot", "render"):
        assert f"  {name} " in done.stdout
    assert done.stdout.splitlines()[-1] == "[]"


def test_analytic_models_are_fitted_shown_and_converted(command, folder, tmp_path):
    done = command("fit", folder / "table.binary", "--model", "ggx", "--gain", 4, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.search(r"table.json: \d+ bytes, ggx, diffuse", done.stdout)
    material = nacre.load(tmp_path / "table.json")
    assert material.metadata["fit"]["gain"] == 4
    assert material.metadata["source"]["file"] == "table.binary"
    done = command("info", "table.json", cwd=tmp_path)
    assert "roughness" in done.stdout
    done = command("convert", "table.json", "-o", "table.binary", cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_every_preset_can_be_chosen(command, folder, tmp_path):
    from nacre.cli.options import preset_option
    from nacre.neural.recipe import PRESETS

    assert tuple(preset_option().type.choices) == tuple(PRESETS)
    settings = ["--preset", "draft", "--epochs", 2, "--samples", 4000]
    done = command("fit", folder / "table.binary", *settings, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    made = nacre.load(tmp_path / "table.safetensors").metadata["fit"]
    assert (made["epochs"], made["learning_rate"]) == (2, PRESETS["draft"]["learning_rate"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--model", "gxx"], "gxx: is no known model; did you mean ggx"),
        (["--model", "ggx", "--preset", "draft"], "--preset is for networks"),
        (["--model", "ggx", "--device", "cpu"], "--device is for networks"),
        (["--model", "ggx", "-o", "x.safetensors"], "do not hold analytic materials"),
        (["-o", "x.json"], "do not hold neural materials"),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    folder, tmp_path, options, message, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert_refused(capsys, message, "fit", folder / "table.binary", *options)


def test_convert_takes_one_material_of_a_table(command, tmp_path):
    lines = (
        f"{name} = Aggregate(Lambertian(albedo = [0.1, 0.2, 0.3]), "
        "NganWard(albedo = [0.3, 0.2, 0.1], roughness = 0.25))"
        for name in ("brass", "steel")
    )
    (tmp_path / "ward.fit").write_text("\n".join(lines))
    done = command("convert", "ward.fit", "-o", "x.json", cwd=tmp_path)
    assert done.returncode == 2
    assert "as --material: brass, steel" in done.stderr
    done = command("convert", "ward.fit", "-o", "x.json", "--material", "steel", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert nacre.load(tmp_path / "x.json").name == "steel"
