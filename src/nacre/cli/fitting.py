"""What `nacre fit` does for reflectances and for a texture."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli import options, plans
from nacre.cli.display import Line
from nacre.cli.kinds import check_pixels, expect
from nacre.cli.reading import check_alone, chosen_material, typed
from nacre.cli.report import (
    aside,
    fail,
    json_key,
    note,
    progress,
    report,
    report_facts,
    report_parts,
    say,
)
from nacre.cli.session import session
from nacre.errors import did_you_mean, printable
from nacre.formats import is_one_material
from nacre.runtime.progress import Progress
from nacre.workflows.watcher import Watcher

if TYPE_CHECKING:
    from nacre.textures.limit import Rate
    from nacre.workflows import Executor, FittedFile, Fitting, Record

_RECIPE = ("inputs", "hidden", "precision", "samples", "seed", "gain", "sampling", "physical")
_SHOWN = 5
"""Most files named from a list that may be long."""


class RunWatcher(Watcher):
    """Shows the progress of a run: one line for the whole, and one for each fit in work."""

    def __init__(self, title: str) -> None:
        self._lock = threading.Lock()
        self._lines: dict[str, Line] = {}
        self._whole = progress(title)
        self._total = self._done = self._failed = 0
        self._whole("looking for changes", 0, 0)

    def dashboard(self, link: str) -> None:
        aside(f"dashboard: {link}")

    def begin(self, materials: int) -> None:
        self._total = materials
        self._update()

    def start(self, name: str) -> Progress:
        line = progress(name)
        with self._lock:
            self._lines[name] = line
            self._update()
        return line

    def end(self, name: str, error: str | None) -> None:
        with self._lock:
            if line := self._lines.pop(name, None):
                line.end()
            self._done += error is None
            self._failed += error is not None
            self._update()

    def _update(self) -> None:
        if self._total == 1:  # the line of the material suffices
            self._whole.end()
        counts = f"{len(self._lines)} running, {self._failed} failed"
        self._whole("fitted", self._done + self._failed, self._total, counts)


def fit_reflectances(paths: Sequence[Path], output: str | None, chosen: Mapping[str, Any]) -> None:
    """Fit files, or all files in folders; exit with 1 if some failed, with 2 if all did."""
    from nacre.workflows import fit_files, output_paths

    folders = any(path.is_dir() and not is_one_material(path) for path in paths)
    ending = _fitting(chosen).ending
    if folders or chosen["scheduler"] is not None:
        check_alone()
    if output == "-":
        if ending != ".json" or len(paths) > 1 or folders:
            raise click.BadParameter(
                "-o -: only one analytic model fits standard output; name a file"
            )
        output = str(session().to_stdout(ending))
    if folders:
        _fit_folders(paths, Path(output or "."), chosen)
        return
    targets = output_paths(paths, output, ending, make_folder=not plans.is_wanted())
    if output is None or not Path(output).suffix:
        targets = [_with_material(*pair) for pair in zip(paths, targets, strict=True)]
    fitting = _fitting(chosen, targets[0].suffix)
    if plans.is_wanted():
        plans.tell_fits(list(zip(paths, targets, strict=True)), chosen)
        return
    options.check_outputs(targets, paths)
    found = fit_files(
        paths, targets, fitting, executor=_executor(chosen), watcher=RunWatcher("fit")
    )
    if chosen["inputs"] is None:
        note_inputs(fitting, targets[0])
    lines = [line for file in found if file.fit.error is None for line in _lines(file)]
    if len(found) == 1 and lines and not session().folders:
        lines.append(f"To see both: nacre compare {found[0].source} {found[0].output}{typed()}")
    report_parts([_facts(file) for file in found], lines)


def _with_material(source: Path, target: Path) -> Path:
    """The name of a fit to one of several materials in a file has that of the material, too."""
    from nacre.targets.text import identifier

    material = chosen_material(source)
    return target.with_stem(f"{target.stem}_{identifier(material)}") if material else target


def _lines(file: FittedFile) -> Iterator[str]:
    """What was written, and how good it is."""
    from nacre.metrics.verdict import psnr_words

    size = file.output.stat().st_size
    yield f"{file.output}: {size:,} bytes, {file.fit.summary}, {file.fit.seconds:.1f} s"
    if (psnr := file.fit.psnr) is not None:
        yield f"  PSNR {psnr:.1f} dB on a sphere in directional light: {psnr_words(psnr)}"
    yield from (f"  {text}" for text in file.fit.notes)


def note_inputs(fitting: Fitting, output: Path) -> None:
    """Note that the file format determined the inputs of a network."""
    if fitting.settings.get("inputs") == "paper":
        note(f"{output}: fitted with the paper's inputs, which {output.suffix} files need")


def _fitting(chosen: Mapping[str, Any], ending: str = "") -> Fitting:
    from nacre.analytic import MODELS
    from nacre.neural import Recipe
    from nacre.workflows import AnalyticFitting, NetworkFitting
    from nacre.workflows.fitting import SPECTRAL

    given: dict[str, Any] = {"ending": ending} if ending else {}
    if (name := chosen["model"]) not in ("nbrdf", SPECTRAL):
        if name not in MODELS:
            known = ["nbrdf", SPECTRAL, *MODELS]
            hint = did_you_mean(name, known, f"known: {', '.join(known)}")
            raise click.BadParameter(f"--model {name}: is no known model{hint}")
        options.refuse(("network",), f"{name} is an analytic model")
        if chosen["precision"] is not None:
            raise click.BadParameter(f"--precision is for networks; {name} is an analytic model")
        if MODELS[name].fitted_on == "pictures":
            for key in ("gain", "samples"):
                if chosen[key] is not None:
                    raise click.BadParameter(f"--{key}: {name} is fitted to pictures")
        settings = {key: chosen[key] for key in ("gain", "samples", "seed")}
        settings = {key: value for key, value in settings.items() if value is not None}
        return AnalyticFitting(MODELS[name], settings, **given)
    if chosen["max_bytes"] is not None and options.is_given("hidden"):
        raise click.UsageError("--max-bytes and --hidden exclude each other")
    if chosen["physical"] and options.is_given("inputs"):
        raise click.UsageError("--physical has its own inputs; leave out --inputs")
    settings = {name: chosen[name] for name in _RECIPE}
    if chosen["epochs"] is not None:
        settings["epochs"] = chosen["epochs"]
    if name == SPECTRAL:
        return _spectral(chosen, settings, given)
    recipe = Recipe.preset(chosen["preset"], size=chosen["max_bytes"], **settings)
    few: dict[str, Any] = {name: chosen[name] for name in ("prior", "free_scale", "intervals")}
    if few["free_scale"] and not few["prior"]:
        raise click.UsageError("--free-scale needs the prior; leave out --no-prior")
    return NetworkFitting(recipe, chosen["device"], **given, **few)


def _spectral(
    chosen: Mapping[str, Any], settings: dict[str, Any], given: dict[str, Any]
) -> Fitting:
    from nacre.neural import Recipe
    from nacre.workflows import SpectralFitting

    for key in ("max_bytes", "device", "free_scale", "intervals", "physical"):
        if chosen[key]:
            flag = key.replace("_", "-")
            raise click.UsageError(f"--{flag} is not for spectral networks; leave it out")
    if not options.is_given("hidden"):
        settings.pop("hidden")
    return SpectralFitting(Recipe.spectral(chosen["preset"], **settings), **given)


def _executor(chosen: Mapping[str, Any]) -> Executor | None:
    """What carries out the fits, or None for the usual executor."""
    from nacre.workflows import Cluster, Threads
    from nacre.workflows.cluster import LOCAL

    scheduler, jobs, data = chosen["scheduler"], chosen["jobs"], chosen["data"]
    if scheduler is None:
        if data != "auto":
            raise click.BadParameter("--data is for a cluster; add its --scheduler")
        # On a device, materials train together unless --jobs limits them.
        return Threads(jobs) if jobs else None
    if scheduler != LOCAL and "://" not in scheduler:
        raise click.BadParameter(f"{scheduler!r} is neither {LOCAL} nor like tcp://host:8786")
    if scheduler != LOCAL and jobs:
        raise click.BadParameter("--jobs is for this machine; a cluster runs one fit per thread")
    return Cluster(scheduler, data=data, workers=jobs)


def _fit_folders(paths: Sequence[Path], output: Path, chosen: Mapping[str, Any]) -> None:
    from nacre.formats import formats
    from nacre.workflows import fit_library
    from nacre.workflows.run import stale_fits

    endings = {ending for entry in formats() for ending in entry.extensions}
    if output.suffix.lower() in endings and not output.is_dir():
        raise click.BadParameter(f"{output}: must be a folder, since the input is one")
    fitting, executor = _fitting(chosen), _executor(chosen)
    if plans.is_wanted():
        stale, current = stale_fits(paths, output, fitting)
        plans.tell_fits([(source.path, output / name) for source, name in stale], chosen, current)
        return
    outcome = fit_library(paths, output, fitting, executor=executor, watcher=RunWatcher("fit"))
    words = ("fitted", "unchanged", "failed")
    counts: dict[str, tuple[Record, ...]] = {word: getattr(outcome, word) for word in words}
    line = ", ".join(f"{len(records)} {word}" for word, records in counts.items() if records)
    rows = {word: [_recorded(record) for record in records] for word, records in counts.items()}
    left_out = [str(path) for path in outcome.left_out]
    report(f"{output}: {line}", {"output": str(output), **rows, "left_out": left_out})
    if outcome.left_out:
        names = printable(", ".join(path.name for path in outcome.left_out[:_SHOWN]))
        more = len(left_out) - _SHOWN
        fail(f"left out, not measurements: {names}{f', and {more} more' if more > 0 else ''}")
    for record in outcome.failed:
        fail(f"{record.source}: {record.error}")
    if outcome.failed:
        raise SystemExit(1)


def _recorded(record: Record) -> dict[str, Any]:
    if record.error is not None:
        return {"file": record.source, "error": record.error}
    facts = {"file": record.source, "output": record.output, "seconds": record.seconds}
    return facts | {json_key(name): value for name, value in record.losses.items()}


def _facts(file: FittedFile) -> dict[str, Any]:
    if (error := file.fit.error) is not None:
        own = error.startswith(f"{file.output}: ")
        return {"file": str(file.source), "error": error if own else f"{file.source}: {error}"}
    return {
        "file": str(file.source),
        "output": str(file.output),
        "size_bytes": file.output.stat().st_size,
        "seconds": file.fit.seconds,
        "psnr_db": file.fit.psnr,
        **({"notes": list(file.fit.notes)} if file.fit.notes else {}),
        **{json_key(name): value for name, value in file.fit.losses.items()},
    }


def chosen_rate(chosen: Mapping[str, Any]) -> Rate | None:
    """What `--bytes-per-texel` and `--quality` say."""
    from nacre.textures.limit import Rate

    given = chosen["bytes_per_texel"], chosen["quality"]
    if None not in given:
        raise click.UsageError("expected either --bytes-per-texel or --quality")
    return Rate.of(*given)


def fit_texture(source: Path, output: str | None, chosen: Mapping[str, Any]) -> None:
    from nacre.metrics.texture_errors import UNITS
    from nacre.textures.codecs.codec_file import codec_path
    from nacre.workflows import encode_texture, output_paths

    if output == "-":
        raise click.BadParameter("-o -: binary files cannot go to standard output; name a file")
    codec, directions = chosen["codec"], chosen["directions"]
    (target,) = output_paths([source], output, ".safetensors", make_folder=not plans.is_wanted())
    state = target.with_name(f"{target.name}.state")
    listed = directions and Path(directions)
    if not plans.is_wanted():
        options.check_outputs([target], [source, codec_path(codec), listed], [state])
    if directions is None:
        check_pixels(source, chosen["pixels"])
    elif not source.is_dir():
        raise click.BadParameter("--directions is for folders of images; leave it out")
    if codec is not None:
        expect(codec, "a texture codec")
    rate = chosen_rate(chosen)
    if rate is not None and options.is_given("precision"):
        raise click.UsageError("expected --precision, or --bytes-per-texel or --quality")
    if plans.is_wanted():
        value = 2 if chosen["precision"] == "half" else 4
        given = {"quantity": chosen["pixels"], "directions": directions}
        plans.tell_texture(source, target, codec_path(codec), value, rate, **given)
        return
    line = progress(target.stem, "reading")
    found = encode_texture(
        source,
        target,
        model=codec,
        directions=directions,
        pixels=chosen["pixels"],
        reference=not chosen["embed"],
        half=chosen["precision"] == "half",
        rate=rate,
        texels_per_block=chosen["texels_per_block"],
        resume=chosen["resume"],
        progress=line,
    )
    height, width, code_dim = found.latent.shape
    nbytes = found.latent.held.nbytes
    shown, by_view = found.errors.shown()
    facts = {
        "width": width,
        "height": height,
        "code dim": code_dim,
        **shown,
        "pairs compared a texel": found.compared,
        **{f"MSE x 1e4, views {name}": mse for name, mse in by_view.items()},
        "seconds": found.seconds,
        "bytes of codes": nbytes,
        "bytes per texel": nbytes / (width * height),
        "bytes": found.nbytes,
        "bytes of the source": found.source_nbytes,
        "ratio": found.source_nbytes / found.nbytes,
    }
    beside = found.beside and found.beside.name
    names = {"file": str(source), "output": str(target), "keep_beside": beside}
    report_facts(target.name, facts, UNITS, **names)
    if beside:
        say(f"{target}: keep {beside} beside it")
