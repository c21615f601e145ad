"""Encoding of textures in little memory, which can be stopped and resumed."""

from __future__ import annotations

import hashlib
import pickle
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.formats import load_btf
from nacre.io.files import PathLike, check_not_inputs, check_writable, digest
from nacre.measured.textures.image_folder import Quantity
from nacre.measured.textures.transposition import transposed
from nacre.metrics.texture_errors import Errors
from nacre.runtime.interrupts import uninterrupted
from nacre.runtime.journal import Journal
from nacre.runtime.progress import Progress, silent
from nacre.runtime.store import Store
from nacre.textures.capture.gonioreflectometer import Capture
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.codecs.codec_file import PRETRAINED, codec_path, load_codec
from nacre.textures.latent_file import check_latent_path, save_latent_map
from nacre.textures.latent_map import CodecFile, LatentMap, NeuralBtf
from nacre.textures.limit import Rate
from nacre.workflows.block_work import BlockWorkers, Results
from nacre.workflows.cluster import Cluster
from nacre.workflows.encoded_blocks import BlockEncoder, EncodedBlocks
from nacre.workflows.identity import source_files, source_fingerprint
from nacre.workflows.openers import TextureFile
from nacre.workflows.rating import rated, rated_errors
from nacre.workflows.submission import EndedError
from nacre.workflows.watcher import Watcher

BLOCK = 1 << 28
"""Bytes of values read at a time; two such blocks are in memory."""
_COMPARED = 1 << 23
"""Approximate number of decoded values from which the error is computed."""


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
    workers: BlockWorkers | None = None,
    keep: bool = False,
    progress: Progress = silent,
) -> Encoding:
    """The codes of all texels of a texture, and their errors.

    While some texels are encoded, the next are read. The result does not depend on the number of
    cores, nor on where blocks are encoded.

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
        File with the blocks that are done, for a later call to resume: a killed process loses at
        most :data:`nacre.runtime.store.SAVE_EVERY` seconds, and Ctrl-C nothing. The
        caller removes it once the codes are saved.
    fingerprint
        What else must be the same to resume, besides what this function sees.
    workers
        Where blocks are encoded; in this process if None.
    keep
        Save the state at the end, too: other work follows before the caller removes it.

    Raises
    ------
    FormatError
        If the texture cannot be read, or the state cannot be written.
    NacreError
        If the codec is for other directions, a code is not finite, the state is damaged or belongs
        to another encoding, or the workers cannot go on; the state then has what is done.
    """
    total = btf.texel_count
    step = texels_per_block or max(1, BLOCK // (12 * btf.pair_count))
    compared = min(btf.pair_count, max(1, _COMPARED // total))
    dtype = np.dtype(np.float16 if half else np.float32)
    sizes = f"{btf.width} {btf.height} {btf.pair_count} {step} {codec.code_dim} {dtype}"
    same = f"{fingerprint} {sizes}"
    blocks = EncodedBlocks(total, step, codec.code_dim, dtype, state, same)
    encoder = BlockEncoder(codec, btf.wi, btf.wo, dtype, compared, btf.name)
    run = workers.encoded if workers else _encoded
    try:
        with closing(run(btf, encoder, blocks.missing)) as results:
            for block, found in results:
                with uninterrupted():
                    blocks.add(block, found)
                blocks.save_if_due()
                mse = 1e4 * blocks.so_far.result().mse
                progress("encoding", blocks.done, total, f"MSE x 1e4 {mse:.3g}")
    except (KeyboardInterrupt, EndedError):
        with uninterrupted():
            blocks.save()
        raise
    if keep:
        blocks.save()
    shape = btf.height, btf.width, codec.code_dim
    return Encoding(blocks.codes.reshape(shape), blocks.errors.result(), compared)


def _encoded(btf: Btf, encoder: BlockEncoder, missing: Sequence[slice]) -> Results:
    """Results in this process, in order."""
    for block, texels in _read_ahead(btf, encoder, missing):
        try:
            found = encoder(block.start, texels)
        except NacreError:
            btf.texels(block)  # says so if it is values of a file that are not finite
            raise
        yield block, found


@dataclass(frozen=True, eq=False)
class Source:
    """A texture to encode, and where it comes from.

    Parameters
    ----------
    texture
        Its values.
    file
        Name of the file or folder that it lies in, or of what it is captured from.
    fingerprint
        What must be the same for an encoding to be resumed.
    nbytes
        Bytes of its files; 0 where it lies in none.
    opener
        Opens it in a worker of a cluster, if it lies in a file.
    """

    texture: Btf
    file: str
    fingerprint: str
    nbytes: int = 0
    opener: TextureFile | None = None

    @classmethod
    def of(
        cls, path: PathLike, pixels: Quantity | None = None, directions: PathLike | None = None
    ) -> Source:
        """The texture in a file, in a folder of images, or of a list of photographs.

        Raises what :func:`nacre.formats.load_btf` does.
        """
        path = Path(path)
        if directions is not None and not path.is_dir():
            raise FormatError(
                f"{path}: a list of directions is for a folder of images; leave it out"
            )
        texture = load_btf(path, quantity=pixels, directions=directions)
        files = source_files(path, texture)
        nbytes = sum(file.stat().st_size for file in files)  # the files may be gone later
        listed = "" if directions is None else digest(Path(directions))
        kept = source_fingerprint(path, files)
        place = None if directions is None else Path(directions).absolute()
        opener = TextureFile(path.absolute(), pixels, place, kept)
        name, fingerprint = path.resolve().name, f"{kept} {pixels} {listed}"
        return cls(texture, name, fingerprint, nbytes, opener)


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
        Bytes of all files of the source, 0 without files, and of the written file.
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
    source: PathLike | Source,
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
    cluster: Cluster | None = None,
    watcher: Watcher | None = None,
    progress: Progress = silent,
) -> EncodedTexture:
    """Encode a texture into a file, in little memory.

    During the work, a state beside the output keeps the codes: Ctrl-C loses nothing, and a killed
    process at most a minute.

    Parameters
    ----------
    source
        A file, a folder of images, or a list of photographs; or a texture that lies in none.
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
        read twice, and stopped work resumes in either pass.
    resume
        Continue where an earlier call stopped, here or on a cluster.
    cluster
        Its workers encode blocks of texels; this process if None. The result is the same.
    watcher
        Told about the dashboard of the cluster.

    Raises
    ------
    FormatError
        If a file cannot be read or written, or is of another kind.
    NacreError
        If an earlier call was stopped and `resume` is not given, the state belongs to another
        encoding, the codec is for other directions, or the cluster does not work.
    MissingExtraError
        If the cluster needs a library that is not installed.
    """
    output, model = check_latent_path(output), codec_path(model)
    included = model in PRETRAINED.values()
    if reference and not included and model.resolve().parent != output.resolve().parent:
        raise FormatError(f"{model}: is not in the folder of {output}; copy it there, or embed it")
    state = output.with_name(f"{output.name}.state")
    inputs = [] if isinstance(source, Source) else [Path(source)]
    check_not_inputs([output, state], [*inputs, model, *([directions] if directions else [])])
    check_writable(output)
    Store(state).check_wanted(resume)
    codec, model_digest = load_codec(model), digest(model)
    if not isinstance(source, Source):
        source = Source.of(source, pixels, directions)
    began = time.monotonic()
    named = CodecFile(model.name, model_digest) if reference else None
    with transposed(source.texture, output.parent, progress=progress) as texels:
        workers = None
        if cluster:
            opener = source.opener if texels is source.texture else None
            workers = BlockWorkers(cluster, opener, watcher or Watcher())
        found = encode(
            texels,
            _encoding_codec(codec, rate),
            half=half,
            texels_per_block=texels_per_block,
            state=state,
            fingerprint=f"{source.fingerprint} {model_digest}",
            workers=workers,
            keep=rate is not None,
            progress=progress,
        )
        store = Store(state, f"{source.fingerprint} {model_digest} {half} {rate}")
        with Journal(store, "rating") as journal:
            latent, errors = _mapped(
                texels, source.file, codec, model.name, found, rate, named, progress, journal
            )
    seconds = time.monotonic() - began
    save_latent_map(latent, output)
    store.remove()
    return EncodedTexture(
        output,
        latent,
        errors,
        found.compared,
        seconds,
        source.nbytes,
        output.stat().st_size,
        model if reference and not included else None,
    )


def encode_capture(
    capture: Capture,
    output: PathLike,
    *,
    model: PathLike | None = None,
    resume: bool = False,
    progress: Progress = silent,
) -> EncodedTexture:
    """Encode a made-up surface as it is measured: values are never all there.

    Parameters, errors and what is resumed are those of :func:`encode_texture`.
    """
    source = Source(capture, capture.name, hashlib.sha256(pickle.dumps(capture)).hexdigest())
    return encode_texture(source, output, model=model, resume=resume, progress=progress)


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
    journal: Journal | None = None,
) -> tuple[LatentMap, Errors]:
    """The codes of a texture from a file, by the codec in a file, with what is known of both."""
    used, errors = _encoding_codec(codec, rate), found.errors
    named = named and replace(named, expanded=used is not codec)
    latent = LatentMap(found.codes, used, btf.wi, btf.wo, btf.name, named)
    if rate is not None:
        latent = rated(latent, codec, rate, progress, journal)
        errors = rated_errors(btf, latent, found.compared, progress, journal)
    facts = {
        "source": {"file": file, "sha256": (btf.source or {}).get("sha256")},
        "model": model,
        "errors": errors.facts() | {"pairs compared a texel": found.compared},
    }
    return replace(latent, codes=latent.held, metadata=facts), errors


def _read_ahead(
    btf: Btf, encoder: BlockEncoder, blocks: Sequence[slice]
) -> Iterator[tuple[slice, npt.NDArray[Any]]]:
    """Runs of texels; the next is read while one is used."""
    with ThreadPoolExecutor(1, "texels") as reader:
        ahead = [reader.submit(encoder.read, btf, block) for block in blocks[:1]]
        for index, block in enumerate(blocks):
            texels = ahead.pop().result()
            if index + 1 < len(blocks):
                ahead.append(reader.submit(encoder.read, btf, blocks[index + 1]))
            yield block, texels
