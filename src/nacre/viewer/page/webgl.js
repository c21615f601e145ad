// WebGL2 in fewer words: programs, textures, and pictures of floats.

export const HEAD = "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2D;\nprecision highp sampler3D;\n";

// Vertices of a triangle over the whole picture.
export const WHOLE = `${HEAD}
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

const SOFTWARE = /swiftshader|llvmpipe|softpipe|basic render/i;

// A canvas's WebGL2; throws an Error in plain words where the browser has none.
export class Context {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true });
    if (!gl || !gl.getExtension("EXT_color_buffer_float"))
      throw new Error("This page needs WebGL2 with float pictures, which this browser does not have or has switched off.");
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const known = gl.getExtension("WEBGL_debug_renderer_info");
    // Whether the processor draws: it is slow at pictures and at reading uniforms, but compiles quickly.
    const software = SOFTWARE.test(gl.getParameter(known ? known.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    Object.assign(this, { gl, canvas, software, linkedPrograms: new Map() });
  }

  // The program of two sources; linked once.
  program(vertex, fragment) {
    const key = `${vertex}\0${fragment}`;
    if (!this.linkedPrograms.has(key)) this.linkedPrograms.set(key, this.linked(vertex, fragment));
    return this.linkedPrograms.get(key);
  }

  // Free a program that is not needed again.
  forget(program) {
    const { gl } = this;
    for (const [key, known] of this.linkedPrograms) if (known === program) this.linkedPrograms.delete(key);
    gl.getAttachedShaders(program.program).forEach((shader) => gl.deleteShader(shader));
    gl.deleteProgram(program.program);
  }

  linked(vertex, fragment) {
    const { gl } = this, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(logs.filter(Boolean).join("\n") || gl.getProgramInfoLog(program));
    }
    const uniforms = new Map();
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const { name, type, size } = gl.getActiveUniform(program, k);
      uniforms.set(name.replace(/\[0\]$/, ""), { type, size, where: gl.getUniformLocation(program, name) });
    }
    return { program, uniforms };
  }

  // Use a program with values for its uniforms: numbers, lists of them (of vectors too), or textures.
  // Values that it has no uniform for are ignored.
  use({ program, uniforms }, values) {
    const { gl } = this;
    gl.useProgram(program);
    let unit = 0;
    for (const [name, value] of Object.entries(values)) {
      const found = uniforms.get(name);
      if (!found) continue;
      const { type, where } = found;
      if (type === gl.SAMPLER_2D || type === gl.SAMPLER_3D || type === gl.SAMPLER_2D_ARRAY || type === gl.UNSIGNED_INT_SAMPLER_2D_ARRAY) {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture({ [gl.SAMPLER_2D]: gl.TEXTURE_2D, [gl.SAMPLER_3D]: gl.TEXTURE_3D }[type] ?? gl.TEXTURE_2D_ARRAY, value);
        gl.uniform1i(where, unit++);
      } else if (type === gl.FLOAT_MAT3) gl.uniformMatrix3fv(where, false, value);
      else if (type === gl.INT || type === gl.BOOL) gl.uniform1i(where, value);
      else if (type === gl.UNSIGNED_INT) gl.uniform1ui(where, value);
      else {
        const size = { [gl.FLOAT_VEC2]: 2, [gl.FLOAT_VEC3]: 3, [gl.FLOAT_VEC4]: 4 }[type] ?? 1;
        gl[`uniform${size}fv`](where, ArrayBuffer.isView(value) ? value : [value].flat());
      }
    }
  }

  // A texture without values yet, of two or three sizes: texels are fetched, unless they are filtered.
  storage(kind, format, size, { levels = 1, filtered = false } = {}) {
    const { gl } = this, texture = gl.createTexture(), filter = filtered ? gl.LINEAR : gl.NEAREST;
    gl.bindTexture(kind, texture);
    gl[`texStorage${size.length}D`](kind, levels, format, ...size);
    gl.texParameteri(kind, gl.TEXTURE_MIN_FILTER, levels > 1 ? gl.NEAREST_MIPMAP_NEAREST : filter);
    gl.texParameteri(kind, gl.TEXTURE_MAG_FILTER, filter);
    return texture;
  }

  // A texture of RGBA floats; `values` fill it.
  texture(size, values = null) {
    const { gl } = this, texture = this.storage(gl.TEXTURE_2D, gl.RGBA32F, size);
    if (values) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ...size, gl.RGBA, gl.FLOAT, values);
    return texture;
  }

  // A 3-D texture of one or three channels: halves where `values` are 16-bit numbers, else floats.
  volume(size, channels, values) {
    const { gl } = this, half = values instanceof Uint16Array, [layout, type] = channels === 3 ? [gl.RGB, "RGB"] : [gl.RED, "R"];
    const texture = this.storage(gl.TEXTURE_3D, gl[`${type}${half ? 16 : 32}F`], size);
    gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, ...size, layout, half ? gl.HALF_FLOAT : gl.FLOAT, values);
    if (gl.getError() === gl.OUT_OF_MEMORY) throw new Error("The graphics card has no memory left for this table.");
    return texture;
  }

  // Pictures of RGBA floats that are drawn to, with a depth where wanted.
  target(count, size, depth = false) {
    const { gl } = this, buffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    const textures = Array.from({ length: count }, () => this.texture(size));
    textures.forEach((texture, k) =>
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, texture, 0));
    gl.drawBuffers(textures.map((_, k) => gl.COLOR_ATTACHMENT0 + k));
    let held = null;
    if (depth) {
      held = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, held);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, ...size);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, held);
    }
    return { buffer, textures, held, size };
  }

  free({ buffer, textures, held }) {
    const { gl } = this;
    gl.deleteFramebuffer(buffer);
    textures.forEach((texture) => gl.deleteTexture(texture));
    gl.deleteRenderbuffer(held);
  }

  clear({ buffer, textures }) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    textures.forEach((_, k) => gl.clearBufferfv(gl.COLOR, k, [0, 0, 0, 0]));
  }

  // Draw next to a target, or to the canvas if it is null.
  aim(target) {
    const { gl, canvas } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target?.buffer ?? null);
    gl.viewport(0, 0, ...(target?.size ?? [canvas.width, canvas.height]));
  }

  // Draw the whole of a target, or of the canvas where it is null.
  fill(target, program, values) {
    const { gl } = this;
    this.aim(target);
    gl.disable(gl.DEPTH_TEST);
    this.use(program, values);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // Numbers of a target, four a texel, the lowest row first.
  read(target, place = 0) {
    const { gl } = this, [width, height] = target.size, values = new Float32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.buffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + place);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, values);
    return values;
  }

  // A grid of triangles: {array, count, buffer} of {vertices, indices}, with so many numbers an attribute.
  mesh({ vertices, indices }, sizes) {
    const { gl } = this, array = gl.createVertexArray(), buffer = gl.createBuffer();
    const stride = 4 * sizes.reduce((a, b) => a + b);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
    let start = 0;
    sizes.forEach((size, k) => {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, size, gl.FLOAT, false, stride, start);
      start += 4 * size;
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return { array, count: indices.length, buffer };
  }

  // Clear a target that has a depth to a color, and draw to it next.
  begin(target, color = [0, 0, 0, 0]) {
    const { gl } = this;
    this.aim(target);
    gl.clearColor(...color);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
  }

  // Draw a mesh on the target that `begin` cleared.
  meshed(program, values, { array, count }) {
    const { gl } = this;
    this.use(program, values);
    gl.bindVertexArray(array);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }
}
