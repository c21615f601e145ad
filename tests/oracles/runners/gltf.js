// Scenes of .glb files, each with a camera and lights, as two viewers draw them: values in floats.

import { rendererOf, pixelsOf } from "/scene.js";
import { encoded, given } from "/shared.js";

const scene = async (place) => (await fetch(`/scene-${place}.glb`)).arrayBuffer();

function together(pictures) {
  return encoded(new Blob(pictures));
}

// The Khronos sample viewer draws on its canvas, whose colors have 8 bits: in place of the canvas
// it gets a target of floats. It has no table of the sheen's albedo with it: `sheen` is one. `edits`
// are pairs of what stands in its shaders, where they have that, and what shall.
export async function khronos({ count, width, height, edits }) {
  const { GltfState, GltfView } = await import("/khronos/gltf-viewer.module.js");
  const gl = Object.assign(document.createElement("canvas"), { width, height }).getContext("webgl2");
  for (const name of ["EXT_color_buffer_float", "OES_texture_float_linear"]) {
    if (!gl.getExtension(name)) throw new Error(`WebGL2 has no ${name}`);
  }
  const target = gl.createFramebuffer();
  const bind = gl.bindFramebuffer.bind(gl);
  bind(gl.FRAMEBUFFER, target);
  for (const [format, place] of [[gl.RGBA32F, gl.COLOR_ATTACHMENT0], [gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
    const buffer = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
    gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
  }
  gl.bindFramebuffer = (kind, buffer) => bind(kind, buffer ?? target);
  const compile = gl.shaderSource.bind(gl);
  gl.shaderSource = (shader, text) =>
    compile(shader, edits.reduce((edited, [from, to]) => edited.replaceAll(from, to), text));
  const view = new GltfView(gl);
  const state = view.createState();
  Object.assign(state.renderingParameters, {
    usePunctual: true,
    useIBL: false,
    renderEnvironmentMap: false,
    toneMap: GltfState.ToneMaps.NONE,
    clearColor: [0, 0, 0, 0],
  });
  state.environment = darkness(await sheenTable(gl), gl.TEXTURE_2D);
  const absent = async () => ({}); // what unpacks textures and meshes, of which there are none
  const loader = view.createResourceLoader(absent, absent, "/khronos/libs/");
  const pictures = [];
  for (let place = 0; place < count; place++) {
    state.gltf = await loader.loadGltf(await scene(place));
    state.sceneIndex = state.cameraIndex = 0;
    view.renderFrame(state, width, height);
    bind(gl.FRAMEBUFFER, target);
    const found = new Float32Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, found);
    pictures.push(found);
  }
  return together(pictures);
}

// An environment of which the table of the sheen is all there is.
function darkness(glTexture, type) {
  const none = Object.fromEntries(
    ["diffuseEnvMap", "specularEnvMap", "lut", "sheenEnvMap", "sheenLUT"].map((name) => [name, {}]),
  );
  const textures = [{ source: 0, type, glTexture, initialized: true }];
  return { ...none, sheenELUT: { index: 0 }, textures, images: [{}], mipCount: 1, iblIntensityScale: 1 };
}

async function sheenTable(gl) {
  const values = await given("sheen");
  const size = Math.sqrt(values.length);
  const table = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, table);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, size, size, 0, gl.RED, gl.FLOAT, values);
  for (const [name, value] of [
    [gl.TEXTURE_MIN_FILTER, gl.LINEAR],
    [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ]) gl.texParameteri(gl.TEXTURE_2D, name, value);
  return table;
}

// `edits` are triples of a chunk of three.js' shaders, what stands in it, and what shall.
export async function three({ count, width, height, edits }) {
  const THREE = await import("three");
  const { GLTFLoader } = await import("/three/examples/jsm/loaders/GLTFLoader.js");
  for (const [chunk, from, to] of edits) {
    if (!THREE.ShaderChunk[chunk].includes(from)) throw new Error(`${chunk} has no ${from}`);
    THREE.ShaderChunk[chunk] = THREE.ShaderChunk[chunk].replaceAll(from, to);
  }
  const renderer = await rendererOf(THREE);
  const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType });
  const pictures = [];
  for (let place = 0; place < count; place++) {
    const file = await new GLTFLoader().parseAsync(await scene(place), "");
    renderer.setRenderTarget(target);
    renderer.render(file.scene, file.cameras[0]);
    pictures.push(await pixelsOf(renderer, target));
  }
  return together(pictures);
}
