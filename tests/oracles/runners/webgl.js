// Functions of a GLSL file in WebGL2: values of pairs, their speed, and the time of a frame.

import { encoded, given } from "/shared.js";
import { context, program } from "/gl.js";

function texture(gl, unit, format, type, layout, width, height, values) {
  gl.activeTexture(gl.TEXTURE0 + unit);
  const result = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, result);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, layout, type, values);
  return result;
}

function median(values) {
  return values.sort((a, b) => a - b)[values.length >> 1];
}

function check(gl) {
  const error = gl.getError();
  if (error || gl.isContextLost()) throw new Error(`WebGL2 failed with error ${error}`);
}

async function target(fragment, width, height) {
  const gl = context(new OffscreenCanvas(1, 1));
  const used = program(gl, fragment);
  for (const [unit, name] of ["first", "second"].entries()) {
    texture(gl, unit, gl.RGB32F, gl.FLOAT, gl.RGB, width, height, await given(name));
    gl.uniform1i(gl.getUniformLocation(used, name), unit);
  }
  const result = texture(gl, 2, gl.RGBA32F, gl.FLOAT, gl.RGBA, width, height, null);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, result, 0);
  gl.viewport(0, 0, width, height);
  return gl;
}

export async function run({ fragment, width, height }) {
  const gl = await target(fragment, width, height);
  const values = new Float32Array(4 * width * height);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, values);
  check(gl);
  return encoded(values);
}

function times(gl, type, kind, draws) {
  const seconds = [];
  const pixel = new type(4);
  for (let i = 0; i <= draws; i++) {
    const start = performance.now();
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, kind, pixel);
    seconds.push((performance.now() - start) / 1000);
  }
  check(gl);
  return seconds.slice(1); // the first one compiles
}

export async function rate({ fragment, width, height, draws }) {
  const gl = await target(fragment, width, height);
  return (width * height) / Math.min(...times(gl, Float32Array, gl.FLOAT, draws));
}

export function frame({ fragment, draws }) {
  const size = 512;
  const gl = context(new OffscreenCanvas(size, size));
  program(gl, fragment);
  gl.viewport(0, 0, size, size);
  return median(times(gl, Uint8Array, gl.UNSIGNED_BYTE, draws));
}
