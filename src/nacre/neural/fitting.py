"""From any reflectance to an NBRDF, alone or many at once."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import replace

from nacre.brdf import Brdf
from nacre.neural.fit_data import FitData, prepare
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.recipe import Recipe
from nacre.neural.training import train
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress, silent

_TRIAL = 20  # one in so many epochs chooses among the starts


def fit(
    brdf: Brdf,
    recipe: Recipe | None = None,
    *,
    device: str | None = None,
    progress: Progress | None = None,
) -> NeuralBrdf:
    """Fit an NBRDF to a reflectance.

    Parameters
    ----------
    brdf
        Any reflectance. One that offers scattered samples (:meth:`nacre.Brdf.scattered`) is fitted
        to these; see :mod:`nacre.neural.scattered`.
    recipe
        Settings; the defaults of :class:`Recipe` where None.
    device
        None for the compiled CPU kernel; a PyTorch device ("cpu", "cuda") to run the same recipe as
        :func:`fit_many` does.
    progress
        Called as the fit goes on.

    Returns
    -------
    NeuralBrdf
        With importance sampling lobes fitted to it, and the settings and losses in its metadata.

    Raises
    ------
    NacreError
        If hardly any sample of the reflectance is valid, a scan has too few, the reflectance is not
        isotropic although it says so, training does not converge, or there is no such device.
    TypeError
        If `brdf` is no reflectance: load a path first (:func:`nacre.load`).
    MissingExtraError
        If a device is given and PyTorch is not installed.

    Notes
    -----
    The loss is equation 1 of the NBRDF paper with a gain (:attr:`Recipe.gain`), which is 1 there;
    scans have another one (:mod:`nacre.neural.scattered`). The output is not clamped while
    training: a ReLU there kills color channels for good.
    """
    if device is not None:
        ((_, network),) = fit_many([brdf], recipe, device=device, progress=progress)
        if isinstance(network, Exception):
            raise network
        return network
    from nacre.neural.replicas import ReplicaTrainer

    report = progress or silent
    material = prepare(brdf, recipe or Recipe(), report)
    settings = material.recipe
    starts = [material.initial_layers(start) for start in range(settings.starts)]
    trial = settings.epochs // _TRIAL
    how = settings.batch, settings.hidden_activation, trial, material.held_out
    with ReplicaTrainer(starts, *how, settings.offset) as trainer:
        quality = train(trainer, material.training, material.held_out, settings, progress)
        layers = trainer.layers()
    report("sampling lobes", 0, 1, "")
    network = material.finish(layers, quality)
    report("sampling lobes", 1, 1, "")
    return network


def fit_many(
    brdfs: Iterable[Brdf],
    recipe: Recipe | None = None,
    *,
    device: str,
    progress: Progress | None = None,
) -> Iterator[tuple[int, NeuralBrdf | Exception]]:
    """Fit an NBRDF to each of many reflectances, those of one kind together on a PyTorch device.

    Networks of the same widths with as many samples train as one batch, each from one start and
    without replicas; otherwise it works as :func:`fit`. A material that cannot be fitted does not
    affect the others.

    Parameters
    ----------
    brdfs
        Reflectances; one at a time is taken, sampled and released.
    recipe
        Settings for all; the defaults of :class:`Recipe` where None.
    device
        PyTorch device: "cpu", "cuda", "cuda:1". When the waiting samples reach its
        :func:`nacre.neural.torch.stack_bytes`, the largest batch is trained.
    progress
        Called as the fits go on, with the median held-out loss of a batch.

    Returns
    -------
    iterator
        Pairs: the place of a reflectance in `brdfs`, from 0, and its network or what went wrong. A
        batch comes when it is done, so places are in no particular order.

    Raises
    ------
    NacreError
        If there is no such device, or while iterating if its memory is exhausted.
    MissingExtraError
        If PyTorch is not installed.
    """
    from nacre.neural.torch import stack_bytes

    room = stack_bytes(device)
    return _fit_many(brdfs, replace(recipe or Recipe(), starts=1), device, room, progress)


def _fit_many(
    brdfs: Iterable[Brdf], recipe: Recipe, device: str, room: int, progress: Progress | None
) -> Iterator[tuple[int, NeuralBrdf | Exception]]:
    waiting: dict[Hashable, dict[int, FitData]] = defaultdict(dict)

    def size(shape: Hashable) -> int:
        return sum(material.size for material in waiting[shape].values())

    for index, brdf in enumerate(brdfs):
        try:
            material = prepare(brdf, recipe, progress or silent)
        except Exception as error:  # whatever it is, it must not affect other materials
            yield index, error.with_traceback(None)  # whose frames hold this material
            continue
        waiting[material.shape][index] = material
        if sum(map(size, waiting)) >= room:
            yield from _fit_stack(waiting.pop(max(waiting, key=size)), device, progress)
    while waiting:
        yield from _fit_stack(waiting.popitem()[1], device, progress)


def _fit_stack(
    stack: Mapping[int, FitData], device: str, progress: Progress | None
) -> Iterator[tuple[int, NeuralBrdf | Exception]]:
    from nacre.neural.torch import SampleStack
    from nacre.neural.torch_steps import stack_trainer
    from nacre.runtime.device import memory_errors

    materials = list(stack.values())
    recipe = materials[0].recipe
    with memory_errors(device):
        first = materials[0].initial_layers()
        form = recipe.hidden_activation, recipe.offset
        trainer = stack_trainer(first, recipe.batch, device, len(materials), *form)
        training = SampleStack([material.training for material in materials], device)
        held_out = SampleStack([material.held_out for material in materials], device)
        losses = train(trainer, training, held_out, recipe, progress)
        layers = trainer.layers()

    def finish(k: int) -> NeuralBrdf | Exception:
        try:
            quality = {name: float(values[k]) for name, values in losses.items()}
            return materials[k].finish(layers[k], quality)
        except Exception as error:
            return error.with_traceback(None)

    report = progress or silent
    report("sampling lobes", 0, len(stack), "")
    finished = thread_map(finish, range(len(stack)))
    for done, (index, result) in enumerate(zip(stack, finished, strict=True), 1):
        report("sampling lobes", done, len(stack), "")
        yield index, result
