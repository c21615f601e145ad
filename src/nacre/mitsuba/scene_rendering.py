"""Renders scene files as Mitsuba does, in passes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import replace

from nacre.array import Image
from nacre.errors import NacreError, is_shortage, require
from nacre.io.files import PathLike
from nacre.mitsuba.denoise import can_denoise
from nacre.mitsuba.denoise import denoise as remove_noise
from nacre.mitsuba.engine import mitsuba, variant_in_use
from nacre.mitsuba.film import FilmPicture, check_colors
from nacre.mitsuba.passes import (
    PASS,
    WHOLE,
    Accumulation,
    needs_wavefronts,
    pass_sizes,
    plan_passes,
    wavefronts,
)
from nacre.mitsuba.preview import first_hits
from nacre.mitsuba.scene_file import SceneChanges, load_changed_scene, scene_reason
from nacre.runtime.store import Store

_NO_BANDS = frozenset({"BatchSensor"})
"""Sensors whose films cannot be cropped to rows."""


class SceneRendering:
    """A scene file that is rendered, with the plugins that :func:`nacre.mitsuba.register` adds.

    In one pass the picture is Mitsuba's own of the same seed and samples. One of more than
    :data:`nacre.mitsuba.passes.WHOLE` samples takes several passes, which have seeds of their own.

    Parameters
    ----------
    path
        A Mitsuba scene (`.xml`); files that it names are found beside it.
    spp
        Samples per pixel; by default those of the scene's sampler.
    seed
        For the samples.
    changes
        What to change in the scene.
    denoise
        Whether to remove noise; the film then does not share samples between pixels. Albedo and
        normals are those that the scene's `aov` integrator is asked for, or rendered for this.
    colors
        Whether the film must hold colors, as it must to be denoised or written as `.png`.
    store
        See :class:`nacre.mitsuba.passes.Accumulation`.

    Raises
    ------
    FormatError
        If the file cannot be read, is no scene, or has no such parameter or sensor.
    NacreError
        If it needs more memory than there is, or must hold colors and does not.
    MissingExtraError, LLVMError
        See :func:`nacre.mitsuba.mitsuba`.
    """

    def __init__(
        self,
        path: PathLike,
        spp: int | None = None,
        seed: int = 0,
        changes: SceneChanges | None = None,
        denoise: bool = False,
        colors: bool = False,
        store: Store | None = None,
    ) -> None:
        changes = changes or SceneChanges()
        if denoise:
            if not can_denoise():
                require("pyoidn", "render")  # says what to install, before a long rendering
            changes = replace(changes, box_filter=True)
        self._path, self._seed, self._denoise = path, seed, denoise
        self._loaded = loaded = load_changed_scene(path, changes)
        sensor = loaded.scene.sensors()[loaded.sensor]
        self._film = sensor.film()
        if colors or denoise:
            check_colors(self._film)
        self.spp = spp or int(sensor.sampler().sample_count())
        """Samples per pixel in all."""
        self._wavefront = needs_wavefronts(loaded.scene)
        width, height = (int(v) for v in self._film.crop_size())
        channels = self._film.base_channels_count() + len(loaded.scene.integrator().aov_names())
        plan = plan_passes(
            width,
            height,
            self.spp,
            self._wavefront,
            denoise,
            channels,
            PASS if self._wavefront else max(PASS, WHOLE // (width * height)),
        )
        self._rows = height if sensor.class_name() in _NO_BANDS else plan.rows
        sizes = pass_sizes([self.spp], plan.samples)
        self._parts = Accumulation(
            loaded.scene,
            sizes,
            seed,
            self._rows,
            sensor=loaded.sensor,
            own_seed=True,
            store=store,
        )

    @property
    def done(self) -> int:
        """Samples per pixel so far."""
        return self._parts.done

    def passes(self) -> Iterator[float]:
        """Render; yields the finished fraction, in (0, 1], after each pass.

        Raises NacreError if Mitsuba cannot render the scene, or memory runs out.
        """
        with wavefronts() if self._wavefront else nullcontext():
            try:
                for done in self._parts.passes():
                    yield done / self.spp
            except NacreError:
                raise
            except Exception as error:  # Mitsuba raises what its plugins and bindings meet
                raise self._failure(error) from error

    def picture(self) -> FilmPicture:
        """The picture of the passes so far, as it is rendered; at least one must be done."""
        return FilmPicture.of(self._film, self._parts.bitmap, self._parts.mean())

    def finished(self) -> FilmPicture:
        """The picture after all passes, denoised where that was asked for.

        Raises NacreError if the denoiser fails, MissingExtraError without `pyoidn`.
        """
        picture = self.picture()
        if not self._denoise:
            return picture
        colors = picture.colors
        albedo = self._asked(picture, "albedo", "RGB")
        normals = self._asked(picture, "sh_normal", "XYZ")
        if albedo is None or normals is None:
            scene, sensor = self._loaded.scene, self._loaded.sensor
            seen = first_hits(mitsuba(), scene, self._seed, self._rows, sensor)
            return picture.with_colors(remove_noise(colors, *seen))
        return picture.with_colors(remove_noise(colors, albedo, normals))

    def _asked(self, picture: FilmPicture, kind: str, axes: str) -> Image | None:
        """The channels of a kind that the scene asks for, None if it does not."""
        name = self._loaded.aovs.get(kind, "")
        return picture.channels([f"{name}.{axis}" for axis in axes])

    def _failure(self, error: Exception) -> NacreError:
        if is_shortage(error):
            return NacreError("memory ran out while rendering: render fewer pixels")
        return NacreError(f"{self._path}: Mitsuba: {scene_reason(error)}")


def render_file(
    path: PathLike,
    spp: int | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    *,
    parameters: Mapping[str, str] | None = None,
    variant: str | None = None,
    sensor: int | str | None = None,
    width: int | None = None,
    height: int | None = None,
    denoise: bool = False,
) -> Image:
    """Render a scene file, with the plugins `nbrdf`, `brdf`, `neuralbtf` and `measuredbtf`.

    Parameters
    ----------
    path
        A Mitsuba scene (`.xml`); files that it names are found beside it.
    spp
        Samples per pixel; by default those of the scene's sampler.
    seed
        For the samples.
    progress
        Called with the fraction that is done, in (0, 1], after each pass.
    parameters
        Values in place of those of the scene's `<default>`s.
    variant
        Mitsuba's variant for this rendering; by default the one that is set.
    sensor
        Number, from 0, or id of a sensor; the first by default.
    width, height
        Of the film in pixels; where only one is given, the film keeps its proportions.
    denoise
        Whether to remove noise.

    Returns
    -------
    array of shape (height, width, 3)
        Linear Rec. 709 RGB, float32.

    Raises
    ------
    FormatError
        If the file cannot be read, is no scene, or has no such parameter or sensor.
    NacreError
        If it cannot be rendered, needs more memory than there is, or its film does not give colors.
    MissingExtraError, LLVMError
        See :func:`nacre.mitsuba.mitsuba`.
    """
    changes = SceneChanges(parameters or {}, sensor, width, height)
    with variant_in_use(variant):
        rendering = SceneRendering(path, spp, seed, changes, denoise, colors=True)
        for part in rendering.passes():
            if progress is not None:
                progress(part)
        return rendering.finished().colors
