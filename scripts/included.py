"""Make the reflectances that come with nacre: `python scripts/included.py DATA`.

Of DATA are read tables of the RGL database (`rgl/*_rgb.bsdf`), to which networks are fitted as by
`nacre fit`, and the networks published with the NBRDF paper (`pretrained/*/*.h5`), which are
rounded to half precision and get lobes for sampling. `make included` runs it, and makes the
textures. The same data give the same files on the same kind of processor.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import nacre
from nacre.brdf import Brdf
from nacre.formats import load_brdf
from nacre.included import families
from nacre.io.files import write_encoded
from nacre.metrics.metrics import image_errors
from nacre.mitsuba.sphere import render_sphere, standard_lights
from nacre.neural import NeuralBrdf
from nacre.neural.file import encode
from nacre.neural.nbrdf import HALF, round_layers
from nacre.sampling import fit_lobes

FAMILIES = {"rgl": "nbrdf-rgl", "merl": "merl", "nielsen": "nielsen"}
"""Families of published networks by their folder."""
QUICK = 64  # directions, which show a rounding


def fitted(table: Path) -> NeuralBrdf:
    """The network of a measured table."""
    return nacre.fit(load_brdf(table))


def rounded(published: NeuralBrdf) -> NeuralBrdf:
    """A published network in half precision."""
    layers = round_layers(published.layers, HALF)
    made = NeuralBrdf(layers, name=published.name.removesuffix("_rgb"), precision=HALF)
    return made.replaced(sampler=fit_lobes(made))


def psnr(reference: Brdf, network: NeuralBrdf, count: int = 512) -> dict[str, float]:
    """In dB, of spheres by light, with so many directions of the environment."""
    found = {}
    for name, light in standard_lights(None, count).items():
        (truth, mask), (other, _) = (render_sphere(b, light) for b in (reference, network))
        found[name] = round(image_errors(truth, other, mask)[0].psnr, 1)
    return found


def judged(network: NeuralBrdf, table: Path, published: NeuralBrdf | None = None) -> NeuralBrdf:
    """A network with its errors: to the table where there is one, and to what was rounded."""
    quality: dict[str, Any] = dict(network.metadata.get("quality", {}))
    if published is not None:
        quality["rounding_psnr"] = min(psnr(published, network, QUICK).values())
    if table.exists():
        errors = psnr(load_brdf(table), network)
        quality |= {f"{light}_psnr": value for light, value in errors.items()}
    return network.replaced(metadata={**network.metadata, "quality": quality})


def make(source: Path) -> str:
    """Write the network of a table, or a published one, into the package; its name and errors."""
    data = source.parents[1] if source.suffix == ".bsdf" else source.parents[2]
    table = data / "rgl" / f"{source.stem}.bsdf"
    if source == table:
        family, network = "rgl", judged(fitted(table), table)
    else:
        published = load_brdf(source)
        assert isinstance(published, NeuralBrdf)
        family = FAMILIES[source.parent.name]
        network = judged(rounded(published), table, published)
    path = families()[family].folder / f"{source.stem.removesuffix('_rgb')}.safetensors"
    write_encoded(path, encode, network, internal=True)
    return f"{family}:{path.stem} {network.metadata['quality']}"


def main(data: Path) -> None:
    """Make all of them, one a core."""
    sources = [*sorted(data.glob("rgl/*_rgb.bsdf")), *sorted(data.glob("pretrained/*/*.h5"))]
    with ProcessPoolExecutor() as pool:
        for line in pool.map(make, sources):
            print(line, flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]))
