"""What `--dry-run` prints: what a command would read, do and write, without any of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli.report import counted, report
from nacre.cli.session import session
from nacre.io.outputs import check_replaceable

if TYPE_CHECKING:
    from nacre.download.databases import Database
    from nacre.textures.capture.dataset import Settings
    from nacre.textures.limit import Rate

_SECONDS = {"draft": 0.3, "standard": 1.5, "best": 12.0}
"""Seconds for the fit of a network with each preset, on two cores."""
_SHOWN = 20
"""Most files that are named."""


def is_wanted() -> bool:
    """Whether the command should only say what it would do."""
    return session().dry_run


def tell(
    reads: Sequence[Path],
    writes: Iterable[tuple[Path, str]],
    work: str,
    *,
    own: bool = False,
) -> None:
    """Print a plan: the files to read, the files to write with a word on each, and the work.

    Raises a FormatError for a file that must not be replaced, unless a library says that they are
    its `own`.
    """
    known = {path: size_of(path) for path in reads}
    lines = [f"would read {path}, {in_bytes(known[path])}" for path in reads[:_SHOWN]]
    if len(reads) > 1:
        more = f"would read {len(reads) - _SHOWN} more files" if len(reads) > _SHOWN else ""
        total = f"would read {in_bytes(sum(known.values()))} in all"
        lines += [line for line in (more, total) if line]
    outputs = list(writes)
    for path, _ in () if own else outputs:
        check_replaceable(path)
    lines.append(f"would {work}")
    for path, about in outputs[:_SHOWN]:
        replaced = ", replacing what is there" if path.is_file() else ""
        lines.append(f"would write {path}{about and ', '}{about}{replaced}")
    if len(outputs) > _SHOWN:
        lines.append(f"would write {len(outputs) - _SHOWN} more files")
    lines.append("nothing was written; leave out --dry-run to do it")
    data = {"reads": [str(path) for path in reads], "writes": [str(path) for path, _ in outputs]}
    report(lines, {"dry_run": True, **data, "size_bytes_read": sum(known.values())})


def tell_fits(
    pairs: Sequence[tuple[Path, Path]], chosen: Mapping[str, Any], current: int | None = None
) -> None:
    """The plan of fits of reflectances; in a library, beside `current` ones that are up to date."""
    work = f"fit {counted(len(pairs), 'material', 'materials')}"
    if chosen["model"] == "nbrdf" and chosen["epochs"] is None and chosen["samples"] is None:
        seconds = max(1.0, _SECONDS[chosen["preset"]] * len(pairs))
        work += f", about {in_time(seconds)} on two cores"
    if current:
        work += f"; {current:,} are up to date"
    outputs = [(output, "") for _, output in pairs]
    tell([source for source, _ in pairs], outputs, work, own=current is not None)


def tell_texture(
    source: Path, target: Path, codec: Path, value: int, rate: Rate | None, **options: Any
) -> None:
    """The plan of the fit of a texture, whose codes have so many bytes per value or a rate."""
    from nacre.formats import load_btf
    from nacre.textures.codecs.codec_file import load_codec

    btf, values = load_btf(source, **options), load_codec(codec).code_dim
    codes = f"{in_bytes(btf.texel_count * values * value)} of codes"
    if rate is not None:
        most = rate.bytes_per_texel
        codes = f"up to {in_bytes(round(btf.texel_count * most))} of codes" if most else "codes"
    pairs = counted(btf.pair_count, "pair of directions", "pairs of directions")
    work = f"encode {btf.width} x {btf.height} texels with {pairs}"
    tell([source], [(target, f"{codes} and the codec")], work)


def tell_download(database: Database, materials: Sequence[str], folder: Path | None) -> None:
    """The plan of a download."""
    from nacre.download import destination

    paths = {name: destination(database, name, folder) for name in materials}
    missing = {name: path for name, path in paths.items() if not path.exists()}
    sizes = [database.facts(name).size for name in missing]
    total = sum(size or 0 for size in sizes)
    work = f"download {counted(len(missing), 'file', 'files')} from {database.name}"
    if missing:
        work += f", {in_bytes(total)}" if all(sizes) else ", of unknown size"
    if len(missing) < len(paths):
        work += f"; {len(paths) - len(missing):,} are there already"
    tell([], [(path, "") for path in missing.values()], work)


def tell_captures(settings: Settings, targets: Sequence[Path], codec: Path | None = None) -> None:
    """The plan of virtual captures, without those that are there; they are values, or codes of a
    codec.
    """
    from nacre.textures.codecs.codec_file import load_codec

    missing = [path for path in targets if not path.exists()]
    texels, pairs = settings.texels**2, len(settings.wi)
    each = f"up to {in_bytes(texels * pairs * 6)} before compression"
    if codec is not None:
        each = f"{in_bytes(4 * texels * load_codec(codec).code_dim)} of codes and the codec"
    paths = texels * settings.samples
    work = (
        f"capture {counted(len(missing), 'texture', 'textures')} of {settings.texels} x "
        f"{settings.texels} texels under {pairs:,} pairs of directions, with {paths:,} light paths "
        "per view"
    )
    tell([], [(path, each) for path in missing], work)


def size_of(path: Path) -> int:
    """Bytes of a file, or of all files directly in a folder."""
    if path.is_dir():
        return sum(each.stat().st_size for each in path.iterdir() if each.is_file())
    return path.stat().st_size


def in_bytes(size: float) -> str:
    """A size as it is said: "12 kB"."""
    for unit in ("bytes", "kB", "MB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.3g} GB"


def in_time(seconds: float) -> str:
    """A time as it is said: "40 seconds", "3 minutes"."""
    for unit, one in (("second", 1.0), ("minute", 60.0)):
        if seconds < 100.0 * one:
            return counted(round(seconds / one), unit, f"{unit}s")
    return counted(round(seconds / 3600.0), "hour", "hours")
