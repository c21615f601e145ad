"""Slang as C++; textures are C++ too: see :mod:`tests.oracles.runners.slang`."""

from __future__ import annotations

import ctypes
import functools
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import best_rate
from tests.oracles.runners import slang
from tests.oracles.texture_runner import FUNCTIONS, TextureRunner, arrays, call
from tests.oracles.textures import Points

_GROUP = 64
_BUFFERS = """import {name};

StructuredBuffer<float4> points;
RWStructuredBuffer<float4> result;
"""
_ENTRY = """
[shader("compute")]
[numthreads({group}, 1, 1)]
void run_{function}(uint3 id : SV_DispatchThreadID)
{{
    let a = points[3 * id.x].xyz;
    let b = points[3 * id.x + 1].xyz;
    let c = points[3 * id.x + 2].xyz;
    result[id.x] = {call};
}}
"""
_TEXTURES = """
// A texture that repeats and is filtered linearly.
struct Floats : ITexture {
    const float* pixels;
    int width, height, layers, channels;

    TextureDimensions GetDimensions(int) override { abort(); }
    void Sample(SamplerState, const float*, void*, size_t) override { abort(); }

    const float* pixel(int x, int y, int layer) const
    {
        return pixels + channels * (x + (size_t)width * (y + (size_t)height * layer));
    }
    void Load(const int32_t* at, void* out, size_t size) override
    {
        memcpy(out, pixel(at[0], at[1], layers ? at[2] : 0), size);
    }
    void SampleLevel(SamplerState, const float* at, float, void* out, size_t) override
    {
        const float x = at[0] * width - 0.5f, y = at[1] * height - 0.5f;
        const float left = floorf(x), top = floorf(y);
        const int layer = layers ? (int)(at[2] + 0.5f) : 0;
        for (int k = 0; k < channels; k++) {
            float sum = 0.0f;
            for (int dy = 0; dy < 2; dy++)
                for (int dx = 0; dx < 2; dx++) {
                    const int column = (((int)left + dx) % width + width) % width;
                    const int row = (((int)top + dy) % height + height) % height;
                    const float across = dx ? x - left : 1 - x + left;
                    const float down = dy ? y - top : 1 - y + top;
                    sum += across * down * pixel(column, row, layer)[k];
                }
            ((float*)out)[k] = sum;
        }
    }
};

extern "C" void* new_texture(const float* pixels, int width, int height, int layers, int channels)
{
    Floats* made = new Floats;
    made->pixels = pixels;
    made->width = width;
    made->height = height;
    made->layers = layers;
    made->channels = channels;
    return static_cast<ITexture*>(made);
}
"""


class SlangCpp(TextureRunner):
    """What slangc makes of the module for C++, on textures of its interface `ITexture`."""

    target = "slang"
    title = "C++ by slangc and g++"

    def missing(self) -> str | None:
        """See :class:`TextureRunner`."""
        return slang.Slang().missing()

    def run(self, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Weights:
        """See :class:`TextureRunner`."""
        return _prepared(files, name, function, points)()[:, : FUNCTIONS[function][1]]

    def rate(self, files: Mapping[str, bytes], name: str, points: Points) -> float:
        """See :class:`TextureRunner`."""
        return best_rate(_prepared(files, name, "eval", points, slang.FAST), len(points.wi))


def _prepared(
    files: Mapping[str, bytes], name: str, function: str, points: Points, level: str = slang.QUICK
) -> Callable[[], Weights]:
    """What computes a function of points."""
    code = {path: body for path, body in files.items() if path.endswith(".slang")}
    library = _library(tuple(code.items()), name, level)
    library.new_texture.restype = ctypes.c_void_p
    count = len(points.wi)
    groups = -(-count // _GROUP)
    inputs = np.zeros((groups * _GROUP, 3, 4), np.float32)
    inputs[:count, :, :3] = np.stack([points.wi, points.wo, points.place], axis=1)
    result = np.zeros((groups * _GROUP, 4), np.float32)
    kept, textures = [], []
    for pixels in arrays(files).values():
        *layers, height, width, channels = pixels.shape
        kept.append(np.ascontiguousarray(pixels, np.float32))
        address = ctypes.c_void_p(kept[-1].ctypes.data)
        shape = width, height, layers[0] if layers else 0, channels
        textures.append(library.new_texture(address, *shape))
    # Buffers, each with how many elements it has, then the sampler, then textures as declared.
    buffers = [inputs.ctypes.data, 3 * len(result), result.ctypes.data, len(result)]
    parameters = (ctypes.c_size_t * (5 + len(textures)))(*buffers, 0, *textures)
    range_ = (ctypes.c_uint32 * 6)(0, 0, 0, groups, 1, 1)
    call_ = functools.partial(getattr(library, f"run_{function}"), range_, None, parameters)
    return functools.partial(_called, call_, result[:count], [inputs, *kept])


def _called(call: Callable[[], None], result: Weights, addressed: list[Weights]) -> Weights:
    """The result of a call, which knows addresses of arrays that have to stay."""
    del addressed
    call()
    return result


@functools.cache
def _library(code: tuple[tuple[str, bytes], ...], name: str, level: str) -> ctypes.CDLL:
    """All functions that a texture has."""
    (content,) = dict(code).values()
    text = _BUFFERS.format(name=name) + "".join(
        _ENTRY.format(group=_GROUP, function=function, call=call(name, function, "float4"))
        for function in FUNCTIONS
        if f" {name}_{function}(".encode() in content
    )
    with tempfile.TemporaryDirectory() as folder:
        made = slang.compiled(Path(folder), dict(code), text, "cpp")
        made.write_text(made.read_text() + _TEXTURES)
        return slang.linked(made, level)
