"""Encoding of textures in little memory, which can be stopped and resumed."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.formats import load_btf
from nacre.io.files import PathLike, check_not_inputs, check_writable, digest, remove_file
from nacre.io.tensors import check_numbers
from nacre.measured.textures.image_folder import Quantity
from nacre.measured.textures.transposition import transposed
from nacre.metrics.texture_errors import Errors, ErrorSums
from nacre.runtime.interrupts import uninterrupted
from nacre.runtime.progress import Progress, silent
from nacre.runtime.store import Store
from nacre.textures.codecs.codec import TexelCodec, on_all_cores
from nacre.textures.codecs.codec_file import PRETRAINED, codec_path, load_codec
from nacre.textures.latent_file import check_latent_path, save_latent_map
from nacre.textures.latent_map import CodecFile, LatentMap, NeuralBtf
from nacre.textures.limit import Rate
from nacre.workflows.identity import source_files, source_fingerprint
from nacre.workflows.rating import rated, rated_errors

BLOCK = 1 << 28
"""Bytes of values read at a time; two such blocks are in memory."""
_COMPARED = 1 << 23
"""Approximate number of decoded values from which the error is computed."""
_SAVE_EVERY = 45.0  # seconds
_LARGEST = 1e100  # number in a state, so that sums stay finite


@dataclass(frozen=True, eq=False)
class Encoding:
    """The result of :func:`encode`.

    Parameters
    ----------
    codes
        Shape (height, width, code_dim).
    errors
        Errors of the decoded codes.
    compared
        Pairs of directions per texel behind the errors, drawn anew for every block of texels.
    """

    codes: npt.NDArray[Any]
    errors: Errors
    compared: int


def encode(
    btf: Btf,
    codec: TexelCodec,
    *,
    half: bool = False,
    texels_per_block: int | None = None,
    state: Path | None = None,
    fingerprint: str = "",
    save_every: float = _SAVE_EVERY,
    progress: Progress = silent,
) -> Encoding:
    """The codes of all texels of a texture, and their errors.

    While some texels are encoded, the next are read.

    Parameters
    ----------
    btf
        Read by runs of texels; see :func:`nacre.measured.textures.transposed` for textures stored
        as images.
    codec
        A codec for its directions.
    half
        Round codes to half precision; errors include the rounding.
    texels_per_block
        Texels read at a time; as many as :data:`BLOCK` holds if None.
    state
        File with the progress, for a later call to resume. The caller removes it once the codes
        are saved.
    fingerprint
        What else must be the same to resume, besides what this function sees.
    save_every
        Seconds between saves of the state: a killed process loses no more, and Ctrl-C nothing.

    Raises
    ------
    FormatError
        If the texture cannot be read, or the state cannot be written.
    NacreError
        If the codec is for other directions, a code is not finite, or the state is damaged or
        belongs to another encoding.
    """
    total = btf.texel_count
    step = texels_per_block or max(1, BLOCK // (12 * btf.pair_count))
    compared = min(btf.pair_count, max(1, _COMPARED // total))
    dtype = np.dtype(np.float16 if half else np.float32)
    sizes = f"{btf.width} {btf.height} {btf.pair_count} {step} {codec.code_dim} {dtype}"
    store = Store(state, f"{fingerprint} {sizes}")
    codes = np.empty((total, codec.code_dim), dtype)
    errors, done = _restored(store, codes)
    if done < total:
        coder = codec.coder(btf.wi, btf.wo)
        encoder = on_all_cores(codec, coder.encode, codec.encoded_together)
    try:
        for block, texels in _read_ahead(btf, codec.takes_half, done, step):
            with np.errstate(over="ignore"):
                found = encoder(texels).astype(dtype)
            if not np.isfinite(found).all():
                btf.texels(block)  # says so if it is values of a file that are not
                raise NacreError(f"{btf.name}: some texels have codes that are not finite")
            chosen = _pairs(btf.pair_count, compared, block.start)
            decode = on_all_cores(codec, coder.decoder(chosen))
            decoded = decode(found.astype(np.float32))
            with uninterrupted():
                errors.add(texels, decoded, btf.wo[chosen], chosen)
                codes[block], done = found, block.stop
            if store.due(save_every):
                store.save({"codes": codes[:done], "errors": errors.sums})
            mse = 1e4 * errors.result().mse
            progress("encoding", done, total, f"MSE x 1e4 {mse:.3g}")
    except KeyboardInterrupt:
        with uninterrupted():
            store.save({"codes": codes[:done], "errors": errors.sums})
        raise
    shape = btf.height, btf.width, codec.code_dim
    return Encoding(codes.reshape(shape), errors.result(), compared)


def _restored(store: Store, codes: npt.NDArray[Any]) -> tuple[ErrorSums, int]:
    """Errors and number of texels from a stopped encoding; fills in its codes."""
    kept = store.load()
    if kept is None:
        return ErrorSums(), 0
    with store.readable():
        found = kept["codes"]
        if found.dtype != codes.dtype or found.shape[1:] != codes.shape[1:]:
            raise ValueError(f"codes are {found.dtype} {found.shape}")
        check_numbers(kept, _LARGEST)
        codes[: len(found)] = found
        return ErrorSums(kept["errors"]), len(found)


@dataclass(frozen=True, eq=False)
class EncodedTexture:
    """The result of :func:`encode_texture`.

    Parameters
    ----------
    path, latent
        The written file, and its content.
    errors, compared
        See :class:`Encoding`.
    seconds
        Time for reading and encoding.
    source_nbytes, nbytes
        Bytes of all files of the source, and of the written file.
    beside
        The codec file, if it must stay beside the written file.
    """

    path: Path
    latent: LatentMap
    errors: Errors
    compared: int
    seconds: float
    source_nbytes: int
    nbytes: int
    beside: Path | None


def encode_texture(
    source: PathLike,
    output: PathLike,
    *,
    model: PathLike | None = None,
    directions: PathLike | None = None,
    pixels: Quantity | None = None,
    reference: bool = False,
    half: bool = False,
    rate: Rate | None = None,
    texels_per_block: int | None = None,
    resume: bool = False,
    progress: Progress = silent,
) -> EncodedTexture:
    """Encode a texture into a file, in little memory.

    During the work, a state beside the output keeps the codes: Ctrl-C loses nothing, and a killed
    process at most a minute.

    Parameters
    ----------
    source
        A file, a folder of images, or a list of photographs.
    output
        File (`.safetensors`) to write.
    model
        Codec file; the pretrained one if None.
    directions
        List of directions (`.csv`) for the folder of images `source`, if it is not in the folder.
    pixels
        Meaning of the pixels in a folder of images, see :func:`nacre.formats.load_btf`.
    reference
        Write the name of the codec file instead of the codec; the file must then stay beside the
        output unless it is the pretrained one.
    half, texels_per_block
        See :func:`encode`.
    rate
        Write codes in so few bytes; see :func:`nacre.workflows.rating.rated`. The texture is then
        read twice.
    resume
        Continue where an earlier call stopped.

    Raises
    ------
    FormatError
        If a file cannot be read or written, or is of another kind.
    NacreError
        If an earlier call was stopped and `resume` is not given, the state belongs to another
        encoding, or the codec is for other directions.
    """
    source, output, model = Path(source), check_latent_path(output), codec_path(model)
    included = model in PRETRAINED.values()
    if reference and not included and model.resolve().parent != output.resolve().parent:
        raise FormatError(f"{model}: is not in the folder of {output}; copy it there, or embed it")
    state = output.with_name(f"{output.name}.state")
    check_not_inputs([output, state], [source, model, *([directions] if directions else [])])
    check_writable(output)
    if state.exists() and not resume:
        raise NacreError(
            f"{state}: an encoding or a training was stopped here; add --resume to continue the "
            "same command, or remove the file"
        )
    codec = load_codec(model)
    if directions is not None and not source.is_dir():
        raise FormatError(f"{source}: a list of directions is for a folder of images; leave it out")
    btf = load_btf(source, quantity=pixels, directions=directions)
    files, model_digest = source_files(source, btf), digest(model)
    nbytes = sum(path.stat().st_size for path in files)  # the files may be gone later
    listed = "" if directions is None else digest(Path(directions))
    fingerprint = f"{source_fingerprint(source, files)} {pixels} {model_digest} {listed}"
    began = time.monotonic()
    named = CodecFile(model.name, model_digest) if reference else None
    with transposed(btf, output.parent, progress=progress) as texels:
        found = encode(
            texels,
            _encoding_codec(codec, rate),
            half=half,
            texels_per_block=texels_per_block,
            state=state,
            fingerprint=fingerprint.rstrip(),
            progress=progress,
        )
        latent, errors = _mapped(
            texels, source.resolve().name, codec, model.name, found, rate, named, progress
        )
    seconds = time.monotonic() - began
    save_latent_map(latent, output)
    remove_file(state)
    return EncodedTexture(
        output,
        latent,
        errors,
        found.compared,
        seconds,
        nbytes,
        output.stat().st_size,
        model if reference and not included else None,
    )


def encoded_texture(
    btf: Btf,
    *,
    model: PathLike | None = None,
    half: bool = False,
    rate: Rate | None = None,
    texels_per_block: int | None = None,
    progress: Progress = silent,
) -> NeuralBtf:
    """Encode a texture in memory; :func:`nacre.save` writes it as :func:`encode_texture` does.

    Parameters are those of :func:`encode_texture`.

    Raises
    ------
    FormatError
        If the texture or the codec cannot be read.
    NacreError
        If the codec is for other directions.
    """
    path = codec_path(model)
    codec = load_codec(path)
    file = (btf.source or {}).get("file", btf.name)
    with transposed(btf, progress=progress) as texels:
        found = encode(
            texels,
            _encoding_codec(codec, rate),
            half=half,
            texels_per_block=texels_per_block,
            progress=progress,
        )
        latent, _ = _mapped(texels, file, codec, path.name, found, rate, None, progress)
    return NeuralBtf(latent)


def _encoding_codec(codec: TexelCodec, rate: Rate | None) -> TexelCodec:
    """The codec whose codes say the most, if few bytes are to hold them."""
    return codec if rate is None else codec.expanded() or codec


def _mapped(
    btf: Btf,
    file: str,
    codec: TexelCodec,
    model: str,
    found: Encoding,
    rate: Rate | None,
    named: CodecFile | None,
    progress: Progress,
) -> tuple[LatentMap, Errors]:
    """The codes of a texture from a file, by the codec in a file, with what is known of both."""
    used, errors = _encoding_codec(codec, rate), found.errors
    named = named and replace(named, expanded=used is not codec)
    latent = LatentMap(found.codes, used, btf.wi, btf.wo, btf.name, named)
    if rate is not None:
        latent = rated(latent, codec, rate, progress)
        errors = rated_errors(btf, latent, found.compared, progress)
    facts = {
        "source": {"file": file, "sha256": (btf.source or {}).get("sha256")},
        "model": model,
        "errors": errors.facts() | {"pairs compared a texel": found.compared},
    }
    return replace(latent, metadata=facts), errors


def _read_ahead(
    btf: Btf, kept: bool, start: int, step: int
) -> Iterator[tuple[slice, npt.NDArray[Any]]]:
    """Runs of texels from `start` on, as they are kept or single; the next is read meanwhile."""
    read = btf.kept_texels if kept else btf.texels
    total = btf.texel_count
    blocks = [slice(first, min(first + step, total)) for first in range(start, total, step)]
    with ThreadPoolExecutor(1, "texels") as reader:
        ahead = [reader.submit(read, block) for block in blocks[:1]]
        for index, block in enumerate(blocks):
            texels = ahead.pop().result()
            if index + 1 < len(blocks):
                ahead.append(reader.submit(read, blocks[index + 1]))
            yield block, texels


def _pairs(total: int, count: int, seed: int) -> slice | npt.NDArray[np.intp]:
    """Random pairs of directions in order, or all."""
    if count == total:
        return slice(None)
    return np.sort(np.random.default_rng(seed).choice(total, count, replace=False))
