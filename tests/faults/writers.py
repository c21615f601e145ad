"""Every command that writes files, as the smallest job that writes all it can."""

from __future__ import annotations

import subprocess
import tempfile
from functools import cache
from pathlib import Path

from tests.faults.commands import LONG, NACRE, PYTHON, Long, slow_server

MADE = {
    "codes.safetensors": "btf capture fabric01 --texels 12 --paths 1 --directions d.csv",
    "codes2.safetensors": "btf capture wood01 --texels 12 --paths 1 --directions d.csv",
    "code.json": "latent project merl:aluminium",
    "code2.json": "latent project merl:delrin",
    "plan.csv": "measure plan -n 4 --of merl:delrin",
    "cloth.npz": "btf capture fabric01 --texels 4 --paths 1 --directions d.csv",
    "cloth2.npz": "btf capture wood01 --texels 4 --paths 1 --directions d.csv",
    "network.safetensors": "fit a.json --samples 1000 --epochs 1 --inputs paper",
    "model.json": "convert a.json",
}
"""How inputs are made, by their names; each is made once."""
WRITTEN = {
    "a.json": '{"model": "ggx", "parameters": {"diffuse": [0.3, 0.2, 0.1], '
    '"specular": [0.05, 0.05, 0.05], "roughness": 0.3}}\n',
    "b.json": '{"type": "diffuse"}\n',
    "d.csv": "theta,phi\n0,0\n30,0\n50,120\n70,240\n",
    "readings.csv": "instrument,angle,quantity,value\ngloss,20,gloss,30\ngloss,60,gloss,60\n",
    "scene.xml": '<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">'
    '<integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>'
    '<integrator type="path"/><emitter type="constant"/><shape type="sphere"/></scene>\n',
}
"""Inputs as text."""


@cache
def content(name: str) -> bytes:
    """The bytes of an input."""
    if name in WRITTEN:
        return WRITTEN[name].encode()
    with tempfile.TemporaryDirectory() as folder:
        for other, text in WRITTEN.items():
            (Path(folder) / other).write_text(text)
        line = [PYTHON, "-m", "nacre", *MADE[name].split(), "-o", f"made/{name}"]
        (Path(folder) / "made").mkdir()
        subprocess.run(line, cwd=folder, check=True, capture_output=True)
        return (Path(folder) / "made" / name).read_bytes()


class Writer(Long):
    """A command whose inputs are those of :data:`MADE` and :data:`WRITTEN`."""

    def write_input(self, folder: Path, name: str, other: bool = False) -> None:
        """See :class:`Long`; another of its kind is not known."""
        path = folder / "inputs" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_bytes() != content(name):
            path.write_bytes(content(name))


def _of(line: str, *outputs: str, journals: tuple[str, ...] = (), **more: object) -> Writer:
    """A command as it is typed: inputs are names in `inputs/`, outputs lie in `out/`."""
    words = line.split()
    inputs = {word[7:]: (word[7:], 0) for word in words if word.startswith("inputs/")}
    verbs = words[: 2 if words[0] in ("btf", "latent", "measure") else 1]
    found = outputs or tuple(word[4:] for word in words if word.startswith("out/"))
    return Writer(
        (*NACRE, *words),
        inputs,
        found,
        journals=journals,
        called=f"nacre {' '.join(verbs)}",
        **more,  # type: ignore[arg-type]
    )


_TARGETS = (
    "c", "glsl", "slang", "wgsl", "three", "brdf", "onnx", "pytorch", "npy", "h5", "osl",
    "materialx", "osl-closures", "materialx-closures", "openpbr", "usda", "gltf", "mdl",
    "principled", "blender-closures", "blender-addon", "web", "usd",
)  # fmt: skip
_EXPORTED = dict.fromkeys(("npy", "h5"), "network.safetensors")
_TEXTURE_TARGETS = "glsl", "slang", "wgsl", "three", "onnx"
_TABLES = (
    "binary", "npz", "mbsdf", "zemax.bsdf", "brdf", "xompt", "xml", "bin", "exr", "csv", "bsdf",
    "fred.txt",
)  # fmt: skip
_SMALL = {
    "binary": "4,4,4", "npz": "4,4,4", "bsdf": "1,4,4,4,4", "mbsdf": "6,6",
}  # fmt: skip
_PICTURE = "--size 16 --spp 1"
_NOISY = f"--no-denoise {_PICTURE}"

WRITERS: dict[str, Long] = {
    "info": _of("info inputs/a.json --no-physics --plot out/lobes.png"),
    "check": _of("check inputs/a.json --only finite,positive -o out/page.html"),
    "compare": _of("compare inputs/a.json merl:delrin -o out/sheet.png --size 16"),
    "compare-texture": _of("compare inputs/cloth.npz inputs/cloth2.npz -o out/sheet.png"),
    **{
        f"plot-{ending}": _of(f"plot inputs/a.json -o out/lobes.{ending}")
        for ending in ("png", "svg", "pdf")
    },
    **{
        f"render-{ending}": _of(f"render inputs/a.json -o out/ball.{ending} {_NOISY}")
        for ending in ("png", "exr", "jpg")
    },
    "render-texture": _of(f"render inputs/codes.safetensors -o out/ball.png {_NOISY}"),
    "render-frames": _of(
        f"render inputs/codes.safetensors -o out/ball.gif --frames 2 --light point {_PICTURE}"
    ),
    "render-scene": _of("render inputs/scene.xml -o out/scene.exr --spp 1 --no-denoise"),
    "view": _of("view inputs/a.json -o out/page.html"),
    "view-component": _of("view --component -o out/nacre.js"),
    "fit": _of("fit inputs/a.json -o out/a.safetensors --samples 1000 --epochs 1"),
    "fit-h5": _of("fit inputs/a.json -o out/a.h5 --samples 1000 --epochs 1"),
    "fit-ggx": _of("fit inputs/plan.csv -o out/a.json --model ggx"),
    "fit-several": _of(
        "fit inputs/a.json inputs/model.json -o out/library/ --samples 1000 --epochs 1",
        "library/*.safetensors",
        several=True,
    ),
    "fit-folder": _of(
        "fit inputs inputs/a.json -o out/library --samples 1000 --epochs 1",
        "library/*.safetensors",
        "library/library.jsonl",
        journals=("library/library.jsonl",),
        states=("library/library.jsonl.lock", "library/.*.lock", "library/library.jsonl"),
        several=True,
    ),
    "fit-texture": _of(
        "fit inputs/cloth.npz -o out/codes.safetensors --resume --texels-per-block 4",
        states=("codes.safetensors.state*",),
    ),
    "estimate": _of(
        "estimate --readings inputs/readings.csv -o out/paint.json", states=("paint.json.state*",)
    ),
    **{
        f"export-{target}": _of(
            f"export inputs/{_EXPORTED.get(target, 'a.json')} --to {target} -o out/made/", "made/*"
        )
        for target in _TARGETS
    },
    **{
        f"export-texture-{target}": _of(
            f"export inputs/codes.safetensors --to {target} -o out/made/", "made/*"
        )
        for target in _TEXTURE_TARGETS
    },
    **{
        f"convert-{ending}": _of(
            f"convert inputs/a.json -o out/table.{ending}"
            + (f" --resolution {_SMALL[ending]}" if ending in _SMALL else "")
        )
        for ending in _TABLES
    },
    "convert-json": _of("convert inputs/a.json -o out/model.json"),
    "convert-npz-texture": _of("convert inputs/cloth.npz -o out/cloth.npz"),
    "convert-btf": _of("convert inputs/cloth.npz -o out/cloth.btf --components 2"),
    "measure-plan": _of("measure plan -n 2 -o out/plan.csv"),
    "measure-next": _of("measure next inputs/plan.csv -n 1 -o out/plan.csv"),
    "measure-bsdf": _of("measure bsdf inputs/b.json -o out/table.binary --resolution 4,4,4"),
    "measure-multiangle": _of("measure multiangle inputs/a.json -o out/colors.png"),
    "capture": _of(
        "btf capture fabric01 -o out/cloth.npz --texels 4 --paths 1 --directions inputs/d.csv "
        "--picture out/cloth.png --height-map out/cloth.exr"
    ),
    "capture-codes": _of(
        "btf capture fabric01 -o out/cloth.safetensors --texels 4 --paths 1 --resume "
        "--directions inputs/d.csv",
        states=("cloth.safetensors.state*",),
    ),
    "btf-plan": _of("btf plan -o out/list.csv --count 2"),
    "tile": _of("btf tile inputs/a.json -o out/codes.safetensors --directions inputs/d.csv"),
    "train-basis": _of(
        "btf train inputs/cloth.npz inputs/cloth2.npz -o out/codec.safetensors --resume "
        "--steps 10 --code-dim 2",
        states=("codec.safetensors.state*",),
    ),
    "train-unified": _of(
        "btf train inputs/cloth.npz inputs/cloth2.npz -o out/codec.safetensors --resume "
        "--model unified --steps 10 --code-dim 2",
        "codec.safetensors",
        "codec.safetensors.journal.csv",
        journals=("codec.safetensors.journal.csv",),
        states=("codec.safetensors.state*",),
    ),
    "recode": _of(
        "btf recode inputs/codes.safetensors -o out/less.safetensors --bytes-per-texel 8 --resume",
        states=("less.safetensors.state*",),
    ),
    "decode": _of("btf decode inputs/codes.safetensors -o out/cloth.npz --directions inputs/d.csv"),
    "synthesize": _of(
        "btf synthesize inputs/codes.safetensors -o out/large.safetensors --texels 16x16"
    ),
    "blend": _of(
        "btf blend inputs/codes.safetensors inputs/codes2.safetensors -o out/both.safetensors"
    ),
    "average": _of("btf average inputs/cloth.npz -o out/mean.safetensors"),
    "picture": _of("btf picture inputs/cloth.npz -o out/sheet.png"),
    "mipmap": _of("btf mipmap inputs/codes.safetensors -o out/levels.png"),
    "nearest": _of("btf nearest inputs/codes.safetensors --texel 1,1 -o out/near.png --count 2"),
    "map": _of(
        "btf map inputs/codes.safetensors -o out/map.png --table out/map.csv --save "
        "out/map.safetensors --count 8"
    ),
    "latent-encode": _of("latent encode inputs/plan.csv -o out/code.json"),
    "latent-decode": _of("latent decode inputs/code.json -o out/table.bsdf"),
    "latent-project": _of("latent project inputs/code.json -o out/code.json"),
    "latent-sample": _of("latent sample --count 2 -o out/codes", "codes/*.json"),
    "latent-picture": _of(f"latent sample --count 1 -o out/codes.png {_PICTURE}"),
    "latent-interpolate": _of(
        f"latent interpolate inputs/code.json inputs/code2.json -o out/strip.png --count 2 "
        f"--codes out/codes {_PICTURE}",
        "strip.png",
        "codes/*.json",
    ),
    "latent-sliders": _of("latent interpolate inputs/code.json -o out/page.html --along darker"),
    "latent-map": _of(
        "latent map inputs/code.json inputs/code2.json merl:nickel merl:chrome merl:steel "
        "-o out/map.png"
    ),
    "latent-train": _of(
        "latent train inputs/a.json inputs/model.json -o out/basis.safetensors --resolution 4,4,4"
        " --code-dim 1"
    ),
    "latent-train-neural": _of(
        "latent train inputs/a.json inputs/model.json -o out/basis.safetensors --model neural "
        "--steps 10 --code-dim 2",
        states=("basis.safetensors.state*", "basis.safetensors.*.state"),
    ),
    "demo": _of("demo inputs/a.json -o out/demo.png --preset draft --spp 1", "*.*"),
    "download": Long(
        LONG["download"].arguments,
        {},
        LONG["download"].outputs,
        states=LONG["download"].states,
        journals=LONG["download"].journals,
        several=True,
        service=slow_server,
    ),
    "bench": _of(
        "bench --quick --methods ggx --only rgl:paper_white -o out/bench.jsonl",
        journals=("bench.jsonl",),
        states=("bench.jsonl*",),
    ),
    "reproduce": _of(
        "reproduce table1 inputs/a.json -o out/table --quick --size 16 --methods ggx",
        "table/table1.csv",
        "table/table1.md",
        "table/cache/*",
        states=("table/cache/*",),
        journals=("table/cache/*", "table/table1.csv", "table/table1.md"),
    ),
}
"""All of them, by the names that `python -m tests.faults` takes with faults of calls."""
