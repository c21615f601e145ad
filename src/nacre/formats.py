"""The registry of file formats, of materials and textures alike, and load() and save() over it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any, cast

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError, in_words
from nacre.included import resolve
from nacre.io import content
from nacre.io.disguise import disguise, missing, zeros
from nacre.io.files import PathLike, first_bytes
from nacre.io.format import Format, Kind, Signature
from nacre.io.head import recognized_head
from nacre.io.packed import inner_names, is_packed, unpacked
from nacre.io.reading import told
from nacre.io.source import Source
from nacre.io.tensors import header_key
from nacre.registry import Registry
from nacre.signatures import SIGNATURES

FORMATS: Registry[Format] = Registry(
    "nacre.formats",
    "format",
    {name: signature.place for name, signature in SIGNATURES.items()},
    base=Format,
    builtin_first=False,
)
"""Every format; those that other packages add come before the built-in ones."""

_OTHERS = {
    "nacre basis": "a latent basis; the nacre latent commands take it",
    "nacre texel network": "a texture codec; nacre fit encodes textures with it",
    "nacre map of texels": "a map of texels, made by nacre btf map",
}
"""What files of ours are that hold no material, by the name of their header."""

_ANY_TEXT = {".txt", ".dat"}
_WORDS: dict[Kind, str] = {"brdf": "one material", "btf": "a texture (BTF)"}


def formats(kind: Kind | None = None) -> tuple[Format, ...]:
    """Every known format, or only those for materials ("brdf") or textures ("btf")."""
    return tuple(entry for _, entry in FORMATS.members() if kind in (None, entry.kind))


def _possible(test: Callable[[Signature], bool]) -> list[Format]:
    """Entries whose signature passes a test, and all that other packages add; no others load."""
    names = [n for n in FORMATS if n not in SIGNATURES or test(SIGNATURES[n])]
    return [entry for _, entry in FORMATS.members(names)]


def identify(path: PathLike, *, by_ending: bool = True) -> Format:
    """The format of what lies at a path: a file, a folder of images, or the name of a material that
    comes with nacre.

    The first bytes decide; the file name decides only between formats that both recognize them, and
    for formats that start with nothing to recognize. A packed file has the format of what is in it
    (:mod:`nacre.io.packed`). Unless `by_ending`, text that only its ending makes a table of samples
    is of no known format: a user who names it means one, a folder may hold anything.

    Raises FormatError if there is nothing, or nothing of a known format; a file that is no data is
    named (:mod:`nacre.io.disguise`).
    """
    path = resolve(path)
    if path.is_dir():
        return _of_folder(path, {})
    with _content(path) as (file, head):
        return _of_file(file, head, by_ending=by_ending)


@contextmanager
def _content(path: Path) -> Iterator[tuple[Path, bytes]]:
    """A file, or the one in a packed file, and its first bytes."""
    if problem := missing(path):
        raise FormatError(f"{path}: {problem}")
    head = recognized_head(path)
    if is_packed(path, head) and not _has_its_length(path):
        with unpacked(path, _all_endings, _is_material) as file:
            yield file, recognized_head(file)
    else:
        yield path, head


def _all_endings() -> set[str]:
    return {ending for entry in formats() for ending in entry.extensions}


def _is_material(path: Path) -> bool:
    """Whether one file among others holds a material; does not raise."""
    with suppress(FormatError):
        entry = _of_file(path, recognized_head(path), by_ending=False)
        alone = entry.claims_folder is None  # a list of photographs needs these
        return alone and (entry.claims is None or entry.claims(path))
    return False


def _of_folder(path: Path, options: dict[str, Any]) -> Format:
    """The format that claims a folder, or the only one for folders that takes the options."""
    possible = _possible(lambda signature: signature.folders)
    entries = [entry for entry in possible if entry.claims_folder is not None]
    taking = [entry for entry in entries if not _unknown_options(entry.load, options)]
    for entry in taking or entries:
        if entry.claims_folder is not None and entry.claims_folder(path):
            return entry
    if options and len(taking) == 1:
        return taking[0]
    raise FormatError(
        f"{path}: is a directory with neither images named like tl000_pl000_tv000_pv000.png nor a "
        "list directions.csv, nor only files of one pab-opto scan; where files in it are materials "
        "or textures, name these"
    )


def _of_file(path: Path, head: bytes, *, by_ending: bool = True) -> Format:
    suffix = path.suffix.lower()
    if problem := _disguise(path, head):
        raise FormatError(f"{path}: {problem}")
    possible = _possible(lambda signature: signature.allows(head))
    known = [entry for entry in possible if entry.recognize and entry.recognize(head)]
    if {entry.kind for entry in known} == {"brdf", "btf"}:
        claimed = [e for e in known if e.kind == "btf" and (e.claims is None or e.claims(path))]
        known = claimed or [entry for entry in known if entry.kind == "brdf"]
    if not known:
        known = _of_any_content(path)
    if not known:
        if other := _other(head):
            raise FormatError(f"{path}: holds no material: it is {other}")
        possible = _possible(
            lambda s: by_ending and s.by_ending and suffix in s.extensions and content.is_text(head)
        )
        table = content.is_table(head)
        known = [e for e in possible if table or e.claims is None or e.claims(path)]
    if not known:
        what = f"is of no known format: it is {content.looks_like(head)}"
        raise FormatError(f"{path}: {what}; {_nearest(suffix, head)}")
    return next((entry for entry in known if suffix in entry.extensions), known[0])


def _nearest(suffix: str, head: bytes) -> str:
    """The two formats that a file of unknown content is most likely meant to be of."""
    names = list(SIGNATURES)
    alike = [n for n in names if suffix and suffix in SIGNATURES[n].extensions]
    alike.sort(key=lambda name: not SIGNATURES[name].by_ending)
    alike += [n for n in content.formats_like(head) if n not in alike]
    nearest = [f"{name} ({SIGNATURES[name].extensions[0]})" for name in alike[:2]]
    if not nearest:
        return "docs/reference/formats.md lists those that are read"
    return f"the nearest {'are' if len(nearest) > 1 else 'is'} {in_words(nearest)}"


def _disguise(path: Path, head: bytes) -> str:
    """What a file is instead of data, and what to do; empty for any other."""
    if _has_its_length(path):
        return ""
    return disguise(head, path) or ("" if any(head) else zeros(path))


def _has_its_length(path: Path) -> bool:
    """Whether a file of a format that begins with anything is claimed by it."""
    fixed = (entry.claims for entry in _of_any_content(path))
    return any(claims is not None and claims(path) for claims in fixed)


def _of_any_content(path: Path) -> list[Format]:
    """Formats that start with nothing to recognize, for a file of their ending."""
    suffix = path.suffix.lower()
    possible = _possible(lambda s: s.pattern is None and suffix in s.extensions)
    return [e for e in possible if e.recognize is None and suffix in e.extensions]


def _other(head: bytes) -> str:
    """What a file of ours is that holds no material; empty for any other."""
    key = header_key(head)
    if key is None or key in ("nacre", "nacre latent map"):
        return ""
    return _OTHERS.get(key, "a file of nacre's own, read by the command that wrote it")


def describe_kind(path: PathLike) -> str:
    """What a file is, in words for a message: "one material (RGL)", "a latent basis; ...".

    Empty if its kind is unknown, or it is damaged beyond recognition or absent; does not raise.
    """
    if other := _other(first_bytes(path)):
        return other
    with suppress(FormatError):
        entry = identify(path)
        return f"{_WORDS[entry.kind]} ({entry.name})"
    return ""


def materials_in(path: PathLike) -> tuple[str, ...]:
    """Names of the materials in a file, "" for those without one; none for a format whose files
    hold one.

    Raises FormatError as :func:`load`.
    """
    path = resolve(path)
    if path.is_dir():
        return ()
    with _content(path) as (file, head):
        entry = _of_file(file, head)
        return () if entry.materials is None else tuple(entry.materials(file))


def reader_options(path: PathLike) -> tuple[str, ...]:
    """Names of the options of :func:`load` that suit a file, of `material` and `bands` too.

    Raises FormatError as :func:`identify`.
    """
    entry = identify(path)
    own = [name for name in inspect.signature(entry.load).parameters if name != "path"]
    several = entry.materials is not None
    return (
        *(n for n in own if several or n != "material"),
        *(["apertures", "bands"] * (entry.kind == "brdf")),
    )


def is_btf(path: PathLike) -> bool:
    """Whether a file or folder is a texture rather than one material; does not raise."""
    with suppress(FormatError):
        return identify(path).kind == "btf"
    return False


def is_one_material(path: PathLike) -> bool:
    """Whether a folder is one reflectance whose files belong together; does not raise."""
    with suppress(FormatError):
        return Path(path).is_dir() and _of_folder(Path(path), {}).kind == "brdf"
    return False


def is_measured(path: PathLike) -> bool:
    """Whether a file in a folder is taken for a measured material, by its ending or its content.

    That is so if its ending belongs to a format for measurements, neither a neural nor an analytic
    one. Where other files have the ending too, as images do, its content must be of the format
    or stand in its place, as a pointer does; else damaged files count as well. For a packed file,
    the ending and the content are those of what is in it.
    """
    entries = _of_endings(_suffixes(path))
    if not entries:
        return False
    if any(entry.claims is None for entry in entries):
        return True
    try:
        with _content(Path(path)) as (file, head):
            claimed = any(entry.claims is not None and entry.claims(file) for entry in entries)
            return claimed or bool(disguise(head, file))
    except FormatError:
        return True


def has_measured_ending(path: PathLike) -> bool:
    """Whether a file has an ending that measured reflectance has, and not any text, whatever is in
    it.
    """
    return bool(_of_endings(_suffixes(path) - _ANY_TEXT))


def _suffixes(path: PathLike) -> set[str]:
    return {Path(name).suffix.lower() for name in inner_names(path)}


def _of_endings(suffixes: set[str]) -> list[Format]:
    possible = _possible(
        lambda s: s.kind == "brdf" and s.measured and bool(suffixes & {*s.extensions})
    )
    return [e for e in possible if e.kind == "brdf" and e.measured and suffixes & {*e.extensions}]


def load(path: PathLike, material: str | None = None, **options: Any) -> Brdf | Btf:
    """Read a material or a texture from any known file; its content says which.

    Parameters
    ----------
    path
        A measured, analytic or neural material; or a texture: a file, a folder of images, or a list
        of photographs (`.csv`); or the name of one that comes with nacre (:func:`nacre.materials`).
    material
        Name of a material, or its number from 1, for files that hold several.
    options
        `bands`, for what :meth:`nacre.Brdf.in_bands` takes; `apertures` of a scan, half the angles
        of the cones of source and detector in degrees; and those of the format's reader:
        `quantity` and `directions` for photographs (see
        :func:`nacre.measured.textures.load_photographs`), `interpolation` for a MERL table. Those
        that are None count as not given.

    Raises
    ------
    FormatError
        If the file is absent, of no known format, or damaged, if it has no such material, or its
        format no such option.
    MissingExtraError
        If its reader needs a library that is not installed.
    """
    return cast("Brdf | Btf", _load(path, None, material, options))


def load_brdf(path: PathLike, material: str | None = None, **options: Any) -> Brdf:
    """Read one material as :func:`load`, or an encoded texture of one texel as a reflectance.

    Raises FormatError as :func:`load`, or if the file is a texture.
    """
    return cast(Brdf, _load(path, "brdf", material, options))


def load_btf(path: PathLike, **options: Any) -> Btf:
    """Read a texture as :func:`load`; also raises FormatError if the file is one material."""
    return cast(Btf, _load(path, "btf", None, options))


def _load(path: PathLike, kind: Kind | None, material: str | None, given: dict[str, Any]) -> Any:
    """What is in a file, which must be of a kind unless that is None."""
    path = resolve(path)
    options = told(path) | {name: value for name, value in given.items() if value is not None}
    material = options.pop("material", None) if material is None else material
    bands, apertures = options.pop("bands", None), options.pop("apertures", None)
    source = Source(path)
    if path.is_dir():
        loaded, stem = _read(path, _of_folder(path, options), kind, material, options), path.stem
    else:
        with _content(path) as (file, head):
            loaded, stem = _read(file, _of_file(file, head), kind, material, options), file.stem
    if apertures is not None:
        loaded = _through(path, loaded, apertures)
    if bands is not None:
        loaded = _in_bands(path, loaded, bands)
    return loaded.replaced(name=loaded.name or stem, source=source)


def _through(path: Path, loaded: Brdf | Btf, apertures: Sequence[float]) -> Brdf:
    from nacre.measured.scattered import ScatteredBrdf

    if not isinstance(loaded, ScatteredBrdf):
        raise FormatError(f"{path}: apertures: are for scans; leave them out")
    try:
        return loaded.through(*apertures)
    except (TypeError, ValueError) as error:
        raise FormatError(f"{path}: apertures: {error}") from error


def _in_bands(path: Path, loaded: Brdf | Btf, bands: Sequence[float] | str) -> Brdf:
    if isinstance(loaded, Btf):
        raise FormatError(f"{path}: bands: a texture has colors only; leave it out")
    try:
        return loaded.in_bands(bands)
    except NacreError as error:
        raise FormatError(f"{path}: bands: {error}") from error


def _read(
    path: Path, entry: Format, kind: Kind | None, material: str | None, options: dict[str, Any]
) -> Brdf | Btf:
    load = entry.load
    if kind == "btf" and entry.kind == "brdf":
        problem = f"is one material ({entry.name}), not a texture (BTF)"
        raise FormatError(f"{path}: {problem}; nacre btf tile makes a texture from it")
    if kind == "brdf" and entry.kind == "btf":
        if entry.load_material is None:
            problem = "is a texture (BTF), not one material"
            raise FormatError(f"{path}: {problem}; nacre btf average makes one from it")
        load, material, options = entry.load_material, None, {}
    _check_options(path, entry, load, options)
    several = entry.materials is not None and load is entry.load
    if material is not None and not several:
        raise FormatError(f"{path}: holds one material; leave out the name {material!r}")
    loaded: Brdf | Btf = load(path, *([material] if several else []), **options)
    return loaded


def _check_options(
    path: Path, entry: Format, function: Callable[..., Any], options: dict[str, Any]
) -> None:
    for name in _unknown_options(function, options):
        raise FormatError(f"{path}: {name}: is not for {entry.name} files; leave it out")


def _unknown_options(function: Callable[..., Any], options: dict[str, Any]) -> list[str]:
    known = inspect.signature(function).parameters
    return [name for name in options if name not in known]


def save(material: Brdf | Btf, path: PathLike, **options: Any) -> Any:
    """Write a material or a texture to the format that the file name ends in.

    Parameters
    ----------
    material
        A neural material for `.safetensors` and `.h5`, an analytic one for `.json`; any reflectance
        for tables; any texture for `.npz` and `.btf`.
    path
        File to write; replaced only by a whole new one.
    options
        Those of the format's writer: `resolution` of a table, `progress` of a texture, `precision`
        of an archive, `components` of a `.btf`. Those that are None count as not given.

    Returns
    -------
    loss
        What the format has lost, where it keeps only some components of the values (`.btf`); else
        None.

    Raises
    ------
    FormatError
        If no format with this ending can be written, or not from this material, or it has no such
        option, or the path cannot be written.
    """
    path = Path(path)
    entry = target(path, "btf" if isinstance(material, Btf) else "brdf")
    assert entry.save is not None
    given = {name: value for name, value in options.items() if value is not None}
    _check_options(path, entry, entry.save, given)
    return entry.save(material, path, **given)


def target(path: PathLike, kind: Kind = "brdf") -> Format:
    """The format that is written to a file of this name, for a material ("brdf") or a texture
    ("btf").

    Raises FormatError if no format with this ending can be written.
    """
    name, suffix = Path(path).name.lower(), Path(path).suffix.lower()
    possible = _possible(lambda s: s.writes and suffix in s.extensions)
    found = [e for e in possible if e.save is not None and name.endswith(e.written)]
    # The longest ending decides where one is the end of another.
    found.sort(key=lambda entry: -max(len(e) for e in entry.written if name.endswith(e)))
    for entry in found:
        if entry.kind == kind:
            return entry
    endings = ", ".join(
        dict.fromkeys(e for entry in formats(kind) if entry.save is not None for e in entry.written)
    )
    if found:
        held = f"{found[0].name} files hold {_WORDS[found[0].kind]}"
        raise FormatError(f"{path}: {held}, not {_WORDS[kind]} (known: {endings})")
    if not suffix and Path(path).is_dir():
        raise FormatError(f"{path}: is a directory, expected a file name (known: {endings})")
    what = "to write" if kind == "brdf" else "for textures"
    raise FormatError(f"{path}: no format {what} ends in {suffix!r} (known: {endings})")


def loses_bands(brdf: Brdf, path: PathLike, anew: bool = False) -> bool:
    """Whether :func:`save` would write only the color of a reflectance with spectra.

    `anew` is whether a resolution is given, so that a table is tabulated anew. Raises FormatError
    if no format with this ending can be written.
    """
    keeps = target(path).keeps_bands(brdf, Path(path), anew)
    return brdf.wavelengths is not None and not keeps


def writer(
    path: PathLike, resolution: Sequence[int] | None = None
) -> Callable[[Brdf, Path], object]:
    """The function that writes what a file name ends in.

    `resolution` are the numbers of nodes of a table, the format's default where None. Raises
    FormatError if there is no such format, or its tables cannot have this resolution.
    """
    entry = target(path)
    assert entry.save is not None
    if resolution is None:
        return entry.save
    if entry.resolution is None:
        raise FormatError(f"{path}: resolution: that of {entry.name} files is fixed")
    names = [field.name for field in fields(entry.resolution)]
    given = ",".join(map(str, resolution))
    if len(resolution) != len(names):
        raise FormatError(f"{path}: resolution: expected {','.join(names)}, got {given}")
    try:
        return partial(entry.save, resolution=entry.resolution(*resolution))
    except ValueError as error:
        raise FormatError(f"{path}: resolution {given} ({','.join(names)}): {error}") from error


def check_target(path: PathLike, brdf: Brdf) -> None:
    """Raise now what writing a reflectance, or a fit to it, would raise when the work for it is
    done: a FormatError if the format cannot hold it.
    """
    entry = target(path)
    if entry.isotropic and not brdf.isotropic:
        problem = f"{brdf.name or 'this material'} is anisotropic"
        raise FormatError(f"{path}: {entry.name} files hold isotropic reflectance only; {problem}")
