"""Finding a libLLVM that Dr.Jit can use."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from nacre.mitsuba import llvm
from nacre.mitsuba.engine import DEFAULT_VARIANT, VARIABLE, has_cuda


def place(root: Path, *names: str) -> None:
    for name in names:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("usr/lib/x86_64-linux-gnu/libLLVM-14.0.6.so.1", (14, 0)),
        ("usr/lib/x86_64-linux-gnu/libLLVM-15.so.1", (15, 0)),
        ("usr/lib/x86_64-linux-gnu/libLLVM.so.19.1", (19, 1)),
        ("usr/lib64/libLLVM-17.so", (17, 0)),
        ("usr/lib/llvm-18/lib/libLLVM.so", (18, 0)),
        ("opt/homebrew/Cellar/llvm/20.1.7/lib/libLLVM.dylib", (20, 1)),
        ("opt/homebrew/Cellar/llvm@18/18.1.8/lib/libLLVM.dylib", (18, 1)),
        ("somewhere/libLLVM.so", (0, 0)),
    ],
)
def test01_version_from_name(tmp_path: Path, name: str, expected: tuple[int, int]) -> None:
    place(tmp_path, name)
    assert llvm.version(tmp_path / name) == expected


def test02_newest_usable_on_linux(tmp_path: Path) -> None:
    folder = "usr/lib/x86_64-linux-gnu"
    place(tmp_path, f"{folder}/libLLVM-15.so.1", f"{folder}/libLLVM-14.so.1")
    assert llvm.find("linux", (tmp_path,)) is None
    place(tmp_path, f"{folder}/libLLVM-17.so.1", f"{folder}/libLLVM.so.19.1")
    place(tmp_path, "usr/lib/llvm-18/lib/libLLVM.so", "usr/lib/llvm-20/lib/libLLVMCore.so")
    assert llvm.find("linux", (tmp_path,)) == tmp_path / folder / "libLLVM.so.19.1"


def test03_links_are_followed(tmp_path: Path) -> None:
    place(tmp_path, "usr/lib/x86_64-linux-gnu/libLLVM-15.so.1")
    folder = tmp_path / "usr/lib/llvm-19/lib"
    folder.mkdir(parents=True)
    (folder / "libLLVM.so").symlink_to(tmp_path / "usr/lib/x86_64-linux-gnu/libLLVM-15.so.1")
    (folder / "libLLVM.so.1").symlink_to(tmp_path / "absent")
    assert llvm.find("linux", (tmp_path,)) is None


def test04_macos_and_windows(tmp_path: Path) -> None:
    place(tmp_path, "opt/homebrew/Cellar/llvm/19.1.7/lib/libLLVM.dylib")
    (tmp_path / "opt/homebrew/opt").mkdir()
    (tmp_path / "opt/homebrew/opt/llvm").symlink_to(tmp_path / "opt/homebrew/Cellar/llvm/19.1.7")
    found = llvm.find("darwin", (tmp_path,))
    assert found == tmp_path / "opt/homebrew/opt/llvm/lib/libLLVM.dylib"
    place(tmp_path, "LLVM/bin/LLVM-C.dll")
    assert llvm.find("win32", (tmp_path,)) is None
    (tmp_path / "LLVM/lib/clang/18").mkdir(parents=True)
    assert llvm.find("win32", (tmp_path,)) == tmp_path / "LLVM/bin/LLVM-C.dll"


def test05_the_users_choice_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(llvm.VARIABLE, "/theirs/libLLVM.so")
    assert llvm.prepare() == Path("/theirs/libLLVM.so")
    assert os.environ[llvm.VARIABLE] == "/theirs/libLLVM.so"


def test06_nothing_usable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(llvm.VARIABLE, raising=False)
    monkeypatch.setattr(llvm, "find", lambda: None)
    assert llvm.prepare() is None
    assert llvm.VARIABLE not in os.environ


@pytest.mark.parametrize(
    ("release", "expected"),
    [
        ("ID=ubuntu\nID_LIKE=debian\n", "apt-get install libllvm19"),
        ('ID="rhel"\nID_LIKE="fedora"\n', "dnf install llvm-libs"),
        ("ID=plan9\n", "apt-get install libllvm19 (Debian, Ubuntu) or sudo dnf"),
    ],
)
def test07_instruction_on_linux(tmp_path: Path, release: str, expected: str) -> None:
    file = tmp_path / "os-release"
    file.write_text(release)
    assert expected in llvm.instruction("linux", file)


def test08_instruction_elsewhere() -> None:
    assert llvm.instruction("darwin") == "brew install llvm"
    assert "installer" in llvm.instruction("win32")


def test09_refusal_names_the_fix() -> None:
    assert llvm.refusal((19, 1, 7)) is None
    assert llvm.refusal((17, 0, 0)) is None
    for found, words in (((16, 0, 6), "found LLVM 16"), ((-1, -1, -1), "found none")):
        reason = llvm.refusal(found)
        assert reason is not None
        assert words in reason
        assert llvm.instruction() in reason


def test10_runs_by_path_without_the_package() -> None:
    done = subprocess.run(
        [sys.executable, "-I", "-S", str(llvm.__file__)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    usable = llvm.find() is not None or bool(os.environ.get(llvm.VARIABLE))
    assert (done.returncode == 0) == usable
    assert done.stdout.count("\n") == 1


def test11_old_llvm_is_refused_before_it_ends_the_process() -> None:
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    old = [p for p in llvm.candidates("linux", (Path("/"),)) if llvm.version(p)[0] in (15, 16)]
    if not old:
        pytest.skip("needs LLVM 15 or 16 beside a newer one")
    code = "import nacre.mitsuba as r\ntry: r.mitsuba()\nexcept r.LLVMError as error: print(error)"
    environment = os.environ | {llvm.VARIABLE: str(old[0]), VARIABLE: DEFAULT_VARIANT}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert f"found LLVM {llvm.version(old[0])[0]}" in done.stdout


VARIANT_CODE = """
import nacre.mitsuba as r
from nacre.errors import NacreError
try: print(r.mitsuba().variant())
except NacreError as error: print(error)
"""


@pytest.mark.parametrize(
    ("named", "expected"),
    [
        ("", DEFAULT_VARIANT),
        ("llvm_ad_rgb", "llvm_ad_rgb"),
        ("scalar_rgb", "NACRE_VARIANT is 'scalar_rgb': give llvm_ad_rgb or cuda_ad_rgb"),
        ("cuda_ad_rgb", "cuda_ad_rgb"),
    ],
)
def test12_the_environment_names_the_variant(named: str, expected: str) -> None:
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    if llvm.prepare() is None and not named.startswith("cuda"):
        pytest.skip(f"needs LLVM {llvm.MINIMUM} or newer")
    environment = os.environ | {VARIABLE: named}
    command = [sys.executable, "-c", VARIANT_CODE]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    if named.startswith("cuda") and not has_cuda():
        expected = "cuda_ad_rgb needs a CUDA device and its driver: Dr.Jit finds none"
    assert done.stdout.strip() == expected
