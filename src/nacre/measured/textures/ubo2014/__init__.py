"""The `.btf` files of the database UBO2014 of the University of Bonn, read and written.

A file holds a texture as three channels, each a matrix of pairs of directions times texels factored
as U . SxV^T: "decorrelated full matrix factorization" (DFMF). Pair `light + lights * view` and
texel `y * width + x` number its rows and columns, or columns and rows.

Layout, little-endian, no padding:

1. `!DFMF08FCR`
2. uint32 size of this part, which starts here, and uint32 version, 1 to 4; texts of 80 bytes:
   setup, sensor, light source; float32 texels per mm, 3 float32 RGB scale; from version 2: uint32
   whether values hold the cosine; from version 3: uint32 length of XML, and it; from version 4:
   uint32 number of channels, and of each a uint32 length of its name, and that
3. uint32 number of views; of each, float32 polar angle and azimuth in radians, uint32 number of
   lights, and their 2 float32 angles each
4. uint32 width, height; uint32 number of rotations, 9 float32 each, row by row
5. uint32 most components, int32 color model, 3 float32 mean color, 9 float32 color matrix
6. of each channel: uint8 bytes of a number (2, 4 or 8: floats), uint32 components k, rows, columns;
   k singular values, U (rows x k), SxV (columns x k), row by row

Bonn's own reader (github.com/cgbonn/btflib) is the source for color models, for the order of pairs
and texels, for which layout a file has, and for the cosine: where the flag is set it divides by the
cosine of the light's polar angle. It keeps the RGB scale and the rotations without using them, and
so does this one. That values are reflectance factors is an assumption.
"""

from nacre.io.format import Format
from nacre.measured.textures.ubo2014.color_models import ColorModel
from nacre.measured.textures.ubo2014.header import MAGIC
from nacre.measured.textures.ubo2014.reader import Ubo2014Btf, load
from nacre.measured.textures.ubo2014.writer import save

FORMAT = Format("UBO2014", (".btf",), lambda head: head.startswith(MAGIC), load, save, kind="btf")

__all__ = ["FORMAT", "ColorModel", "Ubo2014Btf", "load", "save"]
