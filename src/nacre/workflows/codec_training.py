"""Training of texture codecs from files, which can be stopped and resumed."""

from __future__ import annotations

import glob
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.formats import load_btf
from nacre.io.files import PathLike, check_not_inputs, check_writable, remove_file
from nacre.measured.textures.image_folder import Quantity
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import CODECS, TexelCodec, TrainingRun
from nacre.textures.codecs.codec_file import save_codec
from nacre.workflows.identity import source_files, source_fingerprint


def kinds_with(setting: str) -> list[str]:
    """The kinds of codecs whose recipe takes a setting."""
    return [kind for kind, codec in CODECS.members() if setting in codec.recipe_settings()]


def train_codec(
    files: Sequence[PathLike],
    output: PathLike,
    *,
    model: str = "basis",
    pixels: Quantity | None = None,
    half: bool = False,
    resume: bool = False,
    events: PathLike | None = None,
    progress: Progress = silent,
    **settings: Any,
) -> TexelCodec | None:
    """Train a codec on textures and write it.

    During the training, a state beside the output (`OUTPUT.state*`) keeps the progress: Ctrl-C
    loses nothing, and a killed process at most a minute. Codecs that are
    :attr:`TexelCodec.journaled` also write a table of losses, `OUTPUT.journal.csv`.

    Parameters
    ----------
    files
        Textures: files, folders of images, or lists of photographs.
    output
        File (`.safetensors`) to write.
    model
        Kind of codec, one of :data:`nacre.textures.codecs.CODECS`.
    pixels
        Meaning of the pixels in folders of images, see :func:`nacre.formats.load_btf`.
    half
        Write weights in half precision.
    resume
        Continue where an earlier call stopped.
    events
        Folder for a TensorBoard log.
    settings
        Settings for :meth:`TexelCodec.recipe` of the kind: `code_dim`, `steps`, `seed`, ...

    Returns
    -------
    TexelCodec
        None in all but the first process if `torchrun` started several.

    Raises
    ------
    FormatError
        If a texture cannot be read, or the output cannot be written.
    NacreError
        If a setting is impossible or not for this kind of codec, an earlier call was stopped and
        `resume` is not given, or the training fails; see :meth:`TexelCodec.train`.
    """
    kind, output = CODECS.find(model), Path(output)
    if output.suffix.lower() != ".safetensors":
        raise FormatError(f"{output}: a model is a .safetensors file")
    allowed = kind.recipe_settings()
    for name in settings:
        if name not in allowed:
            kinds = " and ".join(kinds_with(name)) or "none"
            raise NacreError(f"{name} is for models of kind {kinds}, not {model}")
    if events is not None and not kind.journaled:
        kinds = " and ".join(name for name, codec in CODECS.members() if codec.journaled)
        raise NacreError(f"events are for models of kind {kinds}, not {model}")
    if not kind.distributed and int(os.environ.get("WORLD_SIZE", "1")) > 1:
        raise NacreError(f"a model of kind {model} trains in one process; leave out torchrun")
    recipe = kind.recipe(**settings)
    state, journal = _beside(output, "state"), _beside(output, "journal.csv")
    check_not_inputs([output, state, *([journal] if kind.journaled else [])], files)
    check_writable(output)
    _check_begun(output, kind.state_files(state), resume)
    load = _Unchanging(partial(load_btf, quantity=pixels), files)
    run = TrainingRun(
        list(files),
        load,
        state,
        f"{[load.fingerprints[path] for path in files]} {pixels}",
        journal if kind.journaled else None,
        None if events is None else Path(events),
        progress,
    )
    codec = kind.train(run, recipe)
    if not is_first_process():
        return None
    save_codec(codec, output, "half" if half else "single")
    for path in kind.state_files(state):
        remove_file(path)
    return codec


class _Unchanging:
    """Opens textures again and again, as long as their files have not changed."""

    def __init__(self, load: Callable[[PathLike], Btf], paths: Sequence[PathLike]) -> None:
        self._load = load
        self.fingerprints = {path: source_fingerprint(path) for path in paths}

    def __call__(self, path: PathLike) -> Btf:
        texture = self._load(path)
        if source_fingerprint(path, source_files(path, texture)) != self.fingerprints[path]:
            raise FormatError(f"{path}: has changed since the training began; start again")
        return texture


def is_first_process() -> bool:
    """Whether this is the only training process, or the first of those `torchrun` started."""
    return os.environ.get("RANK", "0") == "0"


def _beside(output: Path, ending: str) -> Path:
    return output.with_name(f"{output.name}.{ending}")


def _check_begun(output: Path, own: Sequence[Path], resume: bool) -> None:
    """Refuse to start over a stopped training, or to resume one of another kind.

    `own` are the states of this kind; any state of the output begins with its name.
    """
    begin = f"{output.name}.state"
    states = sorted(output.parent.glob(f"{glob.escape(begin)}*"))
    others = [path for path in states if path not in own]
    if others:
        raise NacreError(
            f"{others[0]}: something else was stopped here, an encoding or another model; name "
            f"another output, or remove {begin}* to start again"
        )
    if states and not resume:
        raise NacreError(
            f"{states[0]}: a training was stopped here; add --resume to continue, or remove "
            f"{begin}* to start again"
        )
