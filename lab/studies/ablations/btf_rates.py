"""Error against bytes per texel, of textures that no model has seen.

Every capture is encoded with nacre's codec at several rates, by `nacre fit --bytes-per-texel` and,
from codes of half precision, by `nacre btf recode`; and by what else could be done: principal
components of all training materials, rounded and written the same way; factored channels as in
Bonn's `.btf`; and maps of albedo, normal, roughness and specular reflectance for GGX, fitted texel
by texel (at some texels, as they are without being rounded: 7 bytes). With `--minutes`, a network
is trained for each material.

Errors are mean squares of reflectance factors times 10,000 at all texels and some pairs of
directions, also by the angle of the view. FLIP is that of flat pictures in the light of one
direction, and of the included studio, which the measured lights stand for; means over a view from
above and a steep one. Bytes are those of codes with all that belongs to the texture, without the
shared codec. Sheets show the captures and what is left of them at 64, 8 and 2 bytes.

Run `nacre btf capture leather12 --texels 128 --directions LIST -o UNSEEN/leather12.npz` and so on,
for the recipes in `lab/studies/recipes` too, then `python -m lab.studies.ablations.btf_rates
UNSEEN/*.npz --train TRAIN/*.npz -o OUT`. It takes some minutes of a core for each texture of 128 x
128 texels and 2,601 pairs. Rows of a capture are kept in OUT, so that a later run goes on.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from lab.studies.study import Study, geometric_mean, log, progress
from nacre.array import Floats
from nacre.btf import Btf
from nacre.formats import load_btf
from nacre.geometry import cosine_hemisphere, join
from nacre.measured.textures.directions import from_degrees
from nacre.measured.textures.ubo2014 import writer
from nacre.measured.textures.ubo2014.reader import load
from nacre.metrics.ldr_flip import displayed_flip
from nacre.metrics.texture_errors import ErrorSums
from nacre.mitsuba.preview import write_image
from nacre.mitsuba.studio import studio
from nacre.textures.codecs import load_codec
from nacre.textures.codecs.codec import TexelCodec, TrainingRun, on_all_cores
from nacre.textures.codecs.networks.custom import CustomNetwork
from nacre.textures.codecs.principal.codec import PcaCodec
from nacre.textures.latent_map import LatentMap
from nacre.textures.limit import Rate, limited
from nacre.textures.selection import nearest_pair
from nacre.workflows.encoding import encode
from nacre.workflows.rating import rated

RATES = 32.0, 16.0, 8.0, 4.0, 2.0, 1.0, 0.5
PEERS = 8.0, 4.0, 2.0
PLAIN = "nacre, in half precision"
SHEET = "64", "8", "2"
"""Rates of nacre that sheets show, as rows name them."""
COMPARED = 300  # pairs of directions
VIEWS = (0.0, 0.0), (60.0, 90.0)
LIGHT = 37.5, 240.0
STEEP = 45.0
"""Polar angle from which on a view counts as steep, at an edge of a bin."""
GGX_TEXELS, GGX_PAIRS, GGX_STEPS = 1024, 256, 400
BLOCK = 256
SCALE = 2  # pixels of a texel in pictures

Decode = Callable[[slice], Floats]


class Trial:
    """A capture, and how far others are from it."""

    def __init__(self, btf: Btf) -> None:
        self.btf = btf
        random = np.random.default_rng(1)
        self.chosen = np.sort(random.choice(btf.pair_count, COMPARED, replace=False))
        self.views = [nearest_pair(btf, from_degrees(*LIGHT), from_degrees(*v)) for v in VIEWS]
        lit = [np.flatnonzero((btf.wo == btf.wo[k]).all(axis=1)) for k in self.views]
        self.pairs = np.concatenate([self.chosen, self.views, *lit])
        self.starts = np.cumsum([COMPARED, len(self.views), *map(len, lit)])
        self.weights = [environment_weights(btf.wi[rows]) for rows in lit]
        self.truth = btf.texels(slice(None))[:, self.pairs].astype(np.float32)
        self.pictures = self._pictures([self.truth[:, COMPARED:]])
        self.exposures = [0.9 / float(np.quantile(p, 0.98)) for p in self.pictures]

    @property
    def wi(self) -> Floats:
        return self.btf.wi[self.pairs]

    @property
    def wo(self) -> Floats:
        return self.btf.wo[self.pairs]

    def blocks(self) -> Iterator[slice]:
        for start in range(0, self.btf.texel_count, BLOCK):
            yield slice(start, start + BLOCK)

    def judged(self, decode: Decode) -> tuple[dict[str, float], list[Floats]]:
        """Errors, and pictures."""
        sums, shown = ErrorSums(), []
        for block in self.blocks():
            values = decode(block)
            sums.add(self.truth[block, :COMPARED], values[:, :COMPARED], self.wo[:COMPARED])
            shown.append(values[:, COMPARED:])
        facts = view_errors(sums)
        pictures = self._pictures(shown)
        flips = [self._flip(k, picture) for k, picture in enumerate(pictures)]
        count = len(self.views)
        facts |= {"light": float(np.mean(flips[:count])), "studio": float(np.mean(flips[count:]))}
        return facts, pictures

    def _pictures(self, parts: list[Floats]) -> list[Floats]:
        values = np.concatenate(parts)
        first, *others = np.split(values, self.starts[1:-1] - COMPARED, axis=1)
        found = list(first.swapaxes(0, 1))
        for lit, weights in zip(others, self.weights, strict=True):
            found.append(np.einsum("tnc,nc->tc", lit, weights))
        return [p.reshape(self.btf.height, self.btf.width, 3) for p in found]

    def exposed(self, number: int, picture: Floats) -> Floats:
        """A picture in the exposure of the capture's, each texel of several pixels."""
        return (picture * self.exposures[number]).repeat(SCALE, 0).repeat(SCALE, 1)

    def _flip(self, number: int, picture: Floats) -> float:
        pictures = (self.pictures[number], picture)
        return float(displayed_flip(*(self.exposed(number, p) for p in pictures)).mean())


def view_errors(sums: ErrorSums) -> dict[str, float]:
    errors = sums.result()
    steep = sums.sums[int(STEEP // 15) :].sum(0)
    return {"mse": 1e4 * errors.mse, "steep": 1e4 * float(steep[1] / steep[0])}


def environment_weights(lights: Floats) -> Floats:
    """What a unit of reflectance factor at each light gives in the studio, shape (n, 3)."""
    u = np.random.default_rng(2).random((2, 1 << 16))
    w = join(cosine_hemisphere(*u)).astype(np.float32)
    radiance = studio().exposed().radiance(np.stack([w[:, 0], w[:, 2], -w[:, 1]], -1))
    nearest = np.argmax(w @ lights.T, axis=1)
    sums = [np.bincount(nearest, radiance[:, c], len(lights)) for c in range(3)]
    return np.asarray(np.stack(sums, -1) / len(w), np.float32)


def decoding(trial: Trial, codec: TexelCodec, codes: Floats) -> Decode:
    decode = on_all_cores(codec, codec.decoder(trial.wi, trial.wo))
    flat = np.asarray(codes.reshape(-1, codes.shape[-1]), np.float32)
    return lambda block: decode(flat[block])


def mapped(btf: Btf, codec: TexelCodec, *, half: bool = False) -> LatentMap:
    found = encode(btf, codec, half=half, progress=progress)
    return LatentMap(found.codes, codec, btf.wi, btf.wo, btf.name)


def nacre_rates(trial: Trial, codec: TexelCodec) -> Iterator[tuple[str, str, float, Decode]]:
    """Method, rate, bytes per texel and decoder of each way."""
    expanded = mapped(trial.btf, codec.expanded() or codec)
    shape = *expanded.codes.shape[:2], -1
    flat = codec.shortened(expanded.codes.reshape(-1, expanded.codes.shape[2]))
    plain = LatentMap(flat.reshape(shape).astype(np.float16), codec, trial.btf.wi, trial.btf.wo)
    yield PLAIN, "64", 64.0, decoding(trial, codec, plain.codes)
    for rate in RATES:
        found = rated(expanded, codec, Rate(rate))
        size = found.rated.bytes_per_texel if found.rated else math.nan
        space = "coefficients" if found.codec is not codec else "codes"
        log(f"{trial.btf.name}: {rate:g} bytes: {space}")
        yield "nacre", f"{rate:g}", size, decoding(trial, found.codec, found.codes)
    for rate in (8.0, 4.0, 2.0):
        found = limited(plain, Rate(rate))
        size = found.rated.bytes_per_texel if found.rated else math.nan
        yield "nacre, recoded", f"{rate:g}", size, decoding(trial, codec, found.codes)


def component_rates(trial: Trial, codec: PcaCodec) -> Iterator[tuple[str, str, float, Decode]]:
    plain = mapped(trial.btf, codec)
    name = f"principal components, {codec.code_dim}"
    yield f"{name}, unrounded", "128", 128.0, decoding(trial, codec, plain.codes)
    for rate in PEERS:
        found = limited(plain, Rate(rate))
        size = found.rated.bytes_per_texel if found.rated else math.nan
        yield name, f"{rate:g}", size, decoding(trial, codec, found.codes)


def factored_channels(trial: Trial) -> Iterator[tuple[str, str, float, Decode]]:
    btf = trial.btf
    with tempfile.TemporaryDirectory() as folder:
        for count in (1, 4):
            path = Path(folder) / "channels.btf"
            writer.save(btf, path, components=count)
            size, read = path.stat().st_size / btf.texel_count, load(path)
            yield "factored channels (.btf)", f"{size:.3g}", size, partial(_read, read, trial.pairs)


def _read(btf: Btf, pairs: np.ndarray, block: slice) -> Floats:
    return btf.texels(block)[:, pairs]


def own_network(trial: Trial, minutes: float) -> Iterator[tuple[str, str, float, Decode]]:
    run = TrainingRun([Path(trial.btf.name)], lambda _: trial.btf, progress=progress)
    codec = CustomNetwork.train(run, CustomNetwork.recipe(minutes=minutes))
    decoder = {k: v for k, v in codec.pack("half")[1].items() if k.startswith("decoder")}
    size = 2.0 * codec.code_dim + sum(a.nbytes for a in decoder.values()) / trial.btf.texel_count
    codes = mapped(trial.btf, codec, half=True).codes
    yield "network of the material", f"{size:.3g}", size, decoding(trial, codec, codes)


def ggx_maps(trial: Trial) -> dict[str, float]:
    """Errors of the best GGX at some texels: albedo, a normal, a roughness, and F0."""
    import torch

    random = np.random.default_rng(3)
    texels = np.sort(random.choice(trial.btf.texel_count, GGX_TEXELS, replace=False))
    wi, wo = (torch.tensor(w[:COMPARED]) for w in (trial.wi, trial.wo))
    truth = torch.tensor(trial.truth[texels][:, :COMPARED])
    mean = truth.median(dim=1).values.clamp(0.01, 0.95)
    starts = [torch.logit(mean), torch.zeros(GGX_TEXELS, 2), torch.full((GGX_TEXELS, 2), -1.0)]
    parameters = [start.clone().requires_grad_() for start in starts]
    adam = torch.optim.Adam(parameters, 0.03)

    def values(rows: torch.Tensor) -> torch.Tensor:
        albedo, tilt, gloss = torch.sigmoid(parameters[0]), parameters[1], parameters[2]
        normal = torch.cat([tilt, torch.ones(len(tilt), 1)], 1)
        normal = normal / normal.norm(dim=1, keepdim=True)
        alpha = 0.05 + 0.95 * torch.sigmoid(gloss[:, :1])
        f0 = torch.sigmoid(gloss[:, 1:] - 2.0)
        light, view = wi[rows], wo[rows]
        half = light + view
        half = half / half.norm(dim=1, keepdim=True)
        ni, no, nh = (
            (normal @ w.T).clamp_min(lowest)
            for w, lowest in ((light, 0.0), (view, 1e-3), (half, 0.0))
        )
        a2 = alpha**2
        d = a2 / (math.pi * (nh**2 * (a2 - 1.0) + 1.0) ** 2)
        g = [2.0 * n / (n + torch.sqrt(a2 + (1.0 - a2) * n**2) + 1e-6) for n in (ni, no)]
        fresnel = f0 + (1.0 - f0) * (1.0 - (light * half).sum(1).clamp(0.0, 1.0)) ** 5
        lobe = math.pi * d * g[0] * g[1] * fresnel / (4.0 * ni.clamp_min(1e-3) * no)
        return (albedo[:, None] + lobe[..., None]) * (ni / light[:, 2])[..., None]

    for _ in range(GGX_STEPS):
        rows = torch.randperm(COMPARED)[:GGX_PAIRS]
        loss = (values(rows) - truth[:, rows]).square().mean()
        adam.zero_grad()
        loss.backward()
        adam.step()
    with torch.no_grad():
        found = values(torch.arange(COMPARED)).numpy()
    sums = ErrorSums()
    sums.add(truth.numpy(), found, trial.wo[:COMPARED])
    return view_errors(sums)


def rows_of(
    path: Path, codec: TexelCodec, components: PcaCodec | None, minutes: float, folder: Path
) -> list[dict[str, float | str]]:
    """Rows of a capture, and its sheets."""
    trial = Trial(load_btf(path))
    ways = [nacre_rates(trial, codec), factored_channels(trial)]
    if components is not None:
        ways.append(component_rates(trial, components))
    if minutes:
        ways.append(own_network(trial, minutes))
    rows: list[dict[str, float | str]] = []
    shown: dict[str, list[Floats]] = {}
    for way in ways:
        for method, rate, size, decode in way:
            facts, pictures = trial.judged(decode)
            rows.append(
                {"texture": path.stem, "method": method, "rate": rate, "bytes": size, **facts}
            )
            log(rows[-1])
            if method in (PLAIN, "nacre") and rate in SHEET:
                shown[rate] = pictures
    rows.append({"texture": path.stem, "method": "GGX maps", "rate": "7", "bytes": 7.0})
    rows[-1] |= ggx_maps(trial)
    log(rows[-1])
    columns = [trial.pictures, *(shown[rate] for rate in SHEET)]
    sheet = [
        np.concatenate([trial.exposed(k, pictures[k]) for pictures in columns], axis=1)
        for k in range(len(trial.pictures))
    ]
    write_image(np.concatenate(sheet), folder / f"{path.stem}.png")
    return rows


def main() -> None:
    """Print Markdown tables and write sheets."""
    study = Study(__doc__, __file__)
    study.add_argument("captures", type=Path, nargs="+")
    study.add_argument("--train", type=Path, nargs="+", help="captures for principal components")
    study.add_argument("--minutes", type=float, default=0.0, help="of training for each material")
    options = study.options()
    codec = load_codec("basis")
    components = None
    if options.train:
        run = TrainingRun(options.train, load_btf, progress=progress)
        components = PcaCodec.train(run, PcaCodec.recipe(code_dim=32))
    rows: list[dict[str, float | str]] = []
    for path in study.few(options.captures):
        kept = study.output / f"{path.stem}.json"
        if not kept.exists():
            found = rows_of(path, codec, components, options.minutes, study.output)
            kept.write_text(json.dumps(found))
        rows += json.loads(kept.read_text())
    names = list(dict.fromkeys(str(row["texture"]) for row in rows))
    columns = "method", "bytes per texel", *names, "geometric mean", "steep / mean", "FLIP"
    lines = []
    for key in dict.fromkeys((row["method"], row["rate"]) for row in rows):
        some = [row for row in rows if (row["method"], row["rate"]) == key]
        errors = {str(row["texture"]): float(row["mse"]) for row in some}
        steep = geometric_mean([float(row["steep"]) / float(row["mse"]) for row in some])
        flips = [[float(r[k]) for r in some if k in r] for k in ("light", "studio")]
        means = " / ".join(f"{np.mean(f):.3f}" if f else "" for f in flips)
        size = float(np.mean([float(row["bytes"]) for row in some]))
        texts = [f"{errors[name]:.3g}" if name in errors else "" for name in names]
        mean = geometric_mean(list(errors.values()))
        lines.append([str(key[0]), f"{size:.3g}", *texts, f"{mean:.3g}", f"{steep:.2f}", means])
    study.table(columns, lines)
    draw_curves(rows, study.output / "curves.png")


def draw_curves(rows: list[dict[str, float | str]], path: Path) -> None:
    """Geometric means of errors against means of bytes, both on logarithmic axes."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for method in dict.fromkeys(str(row["method"]) for row in rows):
        own = [row for row in rows if row["method"] == method]
        rates = dict.fromkeys(str(row["rate"]) for row in own)
        points = sorted(
            tuple(
                geometric_mean([float(row[key]) for row in own if row["rate"] == rate])
                for key in ("bytes", "mse")
            )
            for rate in rates
        )
        axes.plot(*zip(*points, strict=True), "o-", ms=4, label=method)
    axes.set(xscale="log", yscale="log", xlabel="bytes per texel", ylabel="MSE x 10\u2074")
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    main()
