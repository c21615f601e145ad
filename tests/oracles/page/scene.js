// Spheres of exported materials in three.js, under lights and an environment.

import { encoded, given } from "/shared.js";

const MODULES = { webgl: "three", webgpu: "three/webgpu", fallback: "three/webgpu" };

export async function rendererOf(THREE, options = {}) {
  const renderer = new (THREE.WebGPURenderer ?? THREE.WebGLRenderer)(options);
  await renderer.init?.();
  const wanted = THREE.WebGPURenderer && !options.forceWebGL;
  if (wanted && !renderer.backend.isWebGPUBackend) throw new Error("three.js found no WebGPU");
  if (renderer.debug) renderer.debug.onShaderError = failed;
  return renderer;
}

function failed(gl, program, vertex, fragment) {
  const logs = [vertex, fragment].map((shader) => gl.getShaderInfoLog(shader));
  throw new Error(logs.join("\n").trim() || gl.getProgramInfoLog(program));
}

function environmentOf(THREE, { width, height }, values) {
  const halves = Uint16Array.from(values, THREE.DataUtils.toHalfFloat);
  const texture = new THREE.DataTexture(halves, width, height, THREE.RGBAFormat, THREE.HalfFloatType);
  texture.mapping = THREE.EquirectangularReflectionMapping;
  texture.flipY = true; // rows come from the top
  texture.needsUpdate = true;
  return texture;
}

function lightOf(THREE, { type, color = [1, 1, 1], intensity = 1, position, target, ...rest }) {
  const light = new THREE[type](new THREE.Color().setRGB(...color), intensity);
  if (position) light.position.set(...position);
  if (target) light.target.position.set(...target);
  return Object.assign(light, rest);
}

// An argument of `picture` is a description:
// renderer, size        "webgl", "webgpu", or "fallback", which is the renderer of WebGPU on WebGL2;
//                       width and height in pixels
// camera                position, target, angle (vertical, in degrees)
// spheres               position, module, and what else `createMaterial` takes; of radius 1
// lights                type, color, intensity, position, ...
// environment           width and height of the values given as "environment", RGBA from the top
// background            whether the environment is seen
// tangents              whether the meshes have tangents, beside coordinates u and v
async function sceneOf(THREE, description) {
  const { camera, spheres, lights = [], environment, background, tangents = true } = description;
  const scene = new THREE.Scene();
  const map = environment && environmentOf(THREE, environment, await given("environment"));
  if (background) scene.background = map;
  const geometry = new THREE.SphereGeometry(1, 256, 128);
  if (tangents) geometry.computeTangents();
  for (const { position = [0, 0, 0], module, ...options } of spheres) {
    const { createMaterial } = await import(module);
    const material = createMaterial(THREE, { environment: map, ...options });
    const sphere = new THREE.Mesh(geometry, material);
    sphere.position.set(...position);
    scene.add(sphere);
  }
  for (const light of lights.map((each) => lightOf(THREE, each))) {
    scene.add(light);
    if (light.target) scene.add(light.target);
  }
  const eye = new THREE.PerspectiveCamera(camera.angle, camera.aspect, 0.1, 100);
  eye.position.set(...camera.position);
  eye.lookAt(...camera.target);
  return { scene, eye };
}

export async function prepared(description, options) {
  const THREE = await import(MODULES[description.renderer]);
  const [width, height] = description.size;
  const forceWebGL = description.renderer === "fallback";
  const renderer = await rendererOf(THREE, { forceWebGL, ...options });
  const camera = { ...description.camera, aspect: width / height };
  const { scene, eye } = await sceneOf(THREE, { ...description, camera });
  const Target = THREE.WebGLRenderTarget ?? THREE.RenderTarget;
  const target = new Target(width, height, { type: THREE.FloatType });
  const draw = (into = target) => {
    renderer.setRenderTarget(into);
    renderer.render(scene, eye);
  };
  return { THREE, renderer, scene, target, draw };
}

// Linear values, RGBA; rows from the top.
export async function values(description) {
  const { renderer, target, draw } = await prepared(description);
  draw();
  return encoded(await pixelsOf(renderer, target));
}

// The picture in the page.
export async function show(description) {
  const { THREE, renderer, draw } = await prepared(description, { antialias: true });
  const [width, height] = description.size;
  renderer.setSize(width, height);
  if (renderer.isWebGLRenderer) {
    document.body.append(renderer.domElement);
    draw(null);
  } else {
    // Chromium without a window shows no canvas of WebGPU on SwiftShader: a copy stands there.
    const output = new THREE.RenderTarget(width, height, { samples: 4 });
    renderer.setOutputRenderTarget(output);
    draw(null);
    const bytes = await pixelsOf(renderer, output);
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    document.body.append(canvas);
    const shown = new ImageData(new Uint8ClampedArray(bytes.buffer), width, height);
    canvas.getContext("2d").putImageData(shown, 0, 0);
  }
  await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
}

export async function pixelsOf(renderer, target, width = target.width, height = target.height) {
  const area = [target, 0, 0, width, height];
  let found = new Float32Array(4 * width * height);
  if (renderer.isWebGLRenderer) renderer.readRenderTargetPixels(...area, found);
  else found = await renderer.readRenderTargetPixelsAsync(...area);
  if (renderer.backend?.isWebGPUBackend) return found;
  const rows = Array.from({ length: height }, (_, y) => found.slice(4 * width * y, 4 * width * (y + 1)));
  return new Blob(rows.reverse()).arrayBuffer();
}
