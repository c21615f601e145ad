"""Subjects of checks from what people have: materials, BSDFs of Mitsuba, objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError, reason, require
from nacre.io.files import PathLike
from nacre.soundness.material import BrdfSubject
from nacre.soundness.mitsuba_bsdf import MitsubaSubject
from nacre.soundness.python_object import ObjectSubject
from nacre.soundness.subject import Subject


def subject(material: Any, name: str = "") -> Subject:
    """What can be checked of a material.

    Parameters
    ----------
    material
        A reflectance; a dictionary for `mitsuba.load_dict`, which is made in each variant; a BSDF
        of Mitsuba's `llvm_ad_rgb`; any object with `eval`, and perhaps `sample`, `pdf`, `gradient`
        and `variants` (:class:`nacre.soundness.python_object.ObjectSubject`); or a subject.
    name
        What to call it; its own name where empty.

    Raises
    ------
    FormatError
        If it is a texture.
    NacreError
        If it cannot be evaluated.
    MissingExtraError, LLVMError
        If Mitsuba is needed and cannot run here.
    """
    found = _made(material)
    if name:
        found.name = name
    return found


def _made(material: Any) -> Subject:
    if isinstance(material, Subject):
        return material
    if isinstance(material, Brdf):
        return BrdfSubject(material)
    if isinstance(material, Btf):
        raise FormatError(f"{material.name or 'this material'}: is a texture; check takes BSDFs")
    if isinstance(material, Mapping):
        return described(material)
    if any(kind.__module__.startswith("mitsuba") for kind in type(material).__mro__):
        return MitsubaSubject(material, str(material.id() or type(material).__name__))
    return ObjectSubject(material)


def described(description: Mapping[str, Any], name: str = "") -> MitsubaSubject:
    """A BSDF from a description for `mitsuba.load_dict`; raises as :func:`subject`."""
    name = name or str(description.get("type", "BSDF"))

    def make() -> Any:
        return require("mitsuba", "render").load_dict(dict(description))

    return MitsubaSubject(_explained(make, name), name)


def in_scene(path: PathLike, identifier: str | None = None) -> MitsubaSubject:
    """The BSDF of a scene (`.xml`) with an id, or its only one.

    Raises
    ------
    FormatError
        If the file cannot be read, or has no such BSDF.
    NacreError, MissingExtraError, LLVMError
        As :func:`subject`.
    """
    from nacre.mitsuba.scene_file import scene_bsdfs

    name = f"{path}#{identifier}" if identifier else str(path)

    def make() -> Any:
        bsdfs = scene_bsdfs(path)
        named = {bsdf.id(): bsdf for bsdf in bsdfs if bsdf.id()}
        if identifier is None and len(bsdfs) == 1:
            return bsdfs[0]
        if identifier in named:
            return named[identifier]
        known = ", ".join(named) or "none"
        problem = f"has no BSDF {identifier!r}" if identifier else "has not just one BSDF; name one"
        raise FormatError(f"{path}: {problem} (found: {known})")

    return MitsubaSubject(_explained(make, name), name)


def _explained(make: Callable[[], Any], name: str) -> Callable[[], Any]:
    """The same function, whose errors are of this package."""

    def made() -> Any:
        try:
            found = make()
        except NacreError:
            raise
        except Exception as error:  # Mitsuba raises what its parser, plugins and bindings meet
            raise NacreError(f"{name}: Mitsuba: {reason(error, whole=True)}") from error
        if not isinstance(found, require("mitsuba", "render").BSDF):
            raise NacreError(f"{name}: is not a BSDF")
        return found

    return made
