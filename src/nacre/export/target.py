"""What a target of exports is, and the registry of targets."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.registry import Registry


class Target(abc.ABC):
    """A language or tool that a material is written for."""

    title: ClassVar[str]
    """What the target is, in a line of a list."""

    @abc.abstractmethod
    def files(self, material: Brdf | Btf) -> Mapping[str, bytes]:
        """The content of the files that the material becomes, by name.

        Raises
        ------
        NacreError
            If the target cannot hold the material; the message says why.
        """


TARGETS: Registry[type[Target]] = Registry("nacre.targets", "export target", {}, base=Target)
"""Targets by the name that users give; packages add theirs by an entry point of `nacre.targets`."""
