// An exported texture in WebGL2: values at points, and the time of a picture.

import { encoded, given } from "/shared.js";
import { context, program } from "/gl.js";

async function bind(gl, used, unit, name, { width, height, layers, channels, bits }) {
  const kind = layers ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D;
  const numbers = await given(name);
  const values = bits === 16 ? new Uint16Array(numbers.buffer, 0, width * height * (layers || 1) * channels) : numbers;
  const [format, layout] = {
    "16 4": [gl.RGBA16F, gl.RGBA],
    "16 1": [gl.R16F, gl.RED],
    "32 4": [gl.RGBA32F, gl.RGBA],
  }[`${bits} ${channels}`];
  const type = bits === 16 ? gl.HALF_FLOAT : gl.FLOAT;
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(kind, gl.createTexture());
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  const filter = bits === 16 ? gl.LINEAR : gl.NEAREST;
  gl.texParameteri(kind, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(kind, gl.TEXTURE_MAG_FILTER, filter);
  if (layers) gl.texImage3D(kind, 0, format, width, height, layers, 0, layout, type, values);
  else gl.texImage2D(kind, 0, format, width, height, 0, layout, type, values);
  gl.uniform1i(gl.getUniformLocation(used, name), unit);
}

async function prepared({ fragment, width, height, textures }) {
  const gl = context(new OffscreenCanvas(1, 1));
  const used = program(gl, fragment);
  for (const [unit, [name, of]] of Object.entries(textures).entries()) await bind(gl, used, unit, name, of);
  gl.activeTexture(gl.TEXTURE0 + Object.keys(textures).length);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
  const result = gl.getParameter(gl.TEXTURE_BINDING_2D);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, result, 0);
  gl.viewport(0, 0, width, height);
  return gl;
}

function check(gl) {
  const error = gl.getError();
  if (error || gl.isContextLost()) throw new Error(`WebGL2 failed with error ${error}`);
}

export async function run(task) {
  const gl = await prepared(task);
  const values = new Float32Array(4 * task.width * task.height);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  gl.readPixels(0, 0, task.width, task.height, gl.RGBA, gl.FLOAT, values);
  check(gl);
  return encoded(values);
}

export async function seconds(task) {
  const gl = await prepared(task);
  const pixel = new Float32Array(4);
  const times = [];
  for (let draw = 0; draw <= task.draws; draw++) {
    const start = performance.now();
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, pixel);
    times.push((performance.now() - start) / 1000);
  }
  check(gl);
  return Math.min(...times.slice(1)); // the first one compiles
}
