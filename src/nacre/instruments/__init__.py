"""What instruments of shops and laboratories read of any material: gloss, haze, colors.

Names load on first use.
"""

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre.instruments.colors import Color as Color
    from nacre.instruments.colors import ciede2000 as ciede2000
    from nacre.instruments.colors import xyz_to_lab as xyz_to_lab
    from nacre.instruments.differences import mean_differences as mean_differences
    from nacre.instruments.forty_five import Bidirectional as Bidirectional
    from nacre.instruments.forty_five import bidirectional as bidirectional
    from nacre.instruments.glossmeter import Gloss as Gloss
    from nacre.instruments.glossmeter import gloss as gloss
    from nacre.instruments.goniocolorimeter import E2194 as E2194
    from nacre.instruments.goniocolorimeter import E2539 as E2539
    from nacre.instruments.goniocolorimeter import Geometry as Geometry
    from nacre.instruments.goniocolorimeter import Multiangle as Multiangle
    from nacre.instruments.goniocolorimeter import multiangle as multiangle
    from nacre.instruments.hazemeter import Haze as Haze
    from nacre.instruments.hazemeter import haze as haze
    from nacre.instruments.illuminants import ILLUMINANTS as ILLUMINANTS
    from nacre.instruments.illuminants import OBSERVERS as OBSERVERS
    from nacre.instruments.integrating_sphere import Sphere as Sphere
    from nacre.instruments.integrating_sphere import (
        directional_hemispherical as directional_hemispherical,
    )
    from nacre.instruments.integrating_sphere import sphere as sphere
    from nacre.instruments.mirror import BLACK_GLASS as BLACK_GLASS
    from nacre.instruments.mirror import Mirror as Mirror
    from nacre.instruments.names import find_quantity as find_quantity
    from nacre.instruments.quantities import Quantity as Quantity
    from nacre.instruments.readings import Reading as Reading
    from nacre.instruments.readings_file import load_readings as load_readings
    from nacre.instruments.readings_file import save_readings as save_readings

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "colors": ["Color", "ciede2000", "xyz_to_lab"],
        "differences": ["mean_differences"],
        "forty_five": ["Bidirectional", "bidirectional"],
        "glossmeter": ["Gloss", "gloss"],
        "goniocolorimeter": ["E2194", "E2539", "Geometry", "Multiangle", "multiangle"],
        "hazemeter": ["Haze", "haze"],
        "illuminants": ["ILLUMINANTS", "OBSERVERS"],
        "integrating_sphere": ["Sphere", "directional_hemispherical", "sphere"],
        "mirror": ["BLACK_GLASS", "Mirror"],
        "names": ["find_quantity"],
        "quantities": ["Quantity"],
        "readings": ["Reading"],
        "readings_file": ["load_readings", "save_readings"],
    },
)
