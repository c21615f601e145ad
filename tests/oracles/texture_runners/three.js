// An exported texture in pages with three.js: its functions at points, and a plane that wears it.

import { encoded, given } from "/shared.js";
import { pixelsOf, rendererOf } from "/scene.js";

const POINTS = ["points_a", "points_b", "points_c"];

async function inputs(THREE, width, height) {
  const found = {};
  for (const name of POINTS) {
    found[name] = new THREE.DataTexture(await given(name), width, height, THREE.RGBAFormat, THREE.FloatType);
    found[name].needsUpdate = true;
  }
  return found;
}

function glslMaterial(THREE, { glsl }, call, textures) {
  const uniforms = Object.fromEntries(Object.entries(textures).map(([key, value]) => [key, { value }]));
  return new THREE.ShaderMaterial({
    uniforms,
    vertexShader: "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }",
    fragmentShader: `uniform sampler2D ${POINTS.join(", ")};
      ${glsl}
      void main() {
        ivec2 place = ivec2(gl_FragCoord.x, float(textureSize(points_a, 0).y) - gl_FragCoord.y);
        vec3 a = texelFetch(points_a, place, 0).xyz;
        vec3 b = texelFetch(points_b, place, 0).xyz;
        vec3 c = texelFetch(points_c, place, 0).xyz;
        gl_FragColor = ${call};
      }`,
    toneMapped: false,
  });
}

async function prepared({ module, call, width, height }) {
  const THREE = await import("three");
  const made = await import(module);
  const textures = { ...(await inputs(THREE, width, height)), ...(await made.loadTextures(THREE)) };
  const renderer = await rendererOf(THREE);
  const quad = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), glslMaterial(THREE, made, call, textures));
  quad.frustumCulled = false;
  const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType, depthBuffer: false });
  renderer.setRenderTarget(target);
  const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -1, 1);
  return { renderer, target, draw: () => renderer.render(quad, camera) };
}

export async function run(task) {
  const { renderer, target, draw } = await prepared(task);
  draw();
  return encoded(await pixelsOf(renderer, target));
}

async function timed(renderer, target, draw, draws) {
  const seconds = [];
  for (let i = 0; i <= draws; i++) {
    const start = performance.now();
    draw();
    await pixelsOf(renderer, target, 1, 1);
    seconds.push((performance.now() - start) / 1000);
  }
  return Math.min(...seconds.slice(1)); // the first one compiles
}

export async function seconds(task) {
  const { renderer, target, draw } = await prepared(task);
  return timed(renderer, target, draw, task.draws);
}

// A plane that fills the picture, seen from above, under one light from a direction.
async function plane({ renderer: kind, module, width, height, repeat, light, samples, environment }) {
  const THREE = await import(kind === "webgl" ? "three" : "three/webgpu");
  const made = await import(module);
  const renderer = await rendererOf(THREE, { forceWebGL: kind === "fallback" });
  const geometry = new THREE.PlaneGeometry(2, 2);
  geometry.attributes.uv.array.forEach((value, k, all) => (all[k] = value * repeat));
  const material = made.createMaterial(THREE, { textures: await made.loadTextures(THREE), samples });
  if (environment !== undefined) {
    const gray = THREE.DataUtils.toHalfFloat(environment);
    const one = THREE.DataUtils.toHalfFloat(1);
    const pixels = new Uint16Array([gray, gray, gray, one]);
    const map = new THREE.DataTexture(pixels, 1, 1, THREE.RGBAFormat, THREE.HalfFloatType);
    map.needsUpdate = true;
    material.environment = map;
  }
  const scene = new THREE.Scene();
  scene.add(new THREE.Mesh(geometry, material));
  if (light) {
    const sun = new THREE.DirectionalLight(0xffffff, 1);
    sun.position.set(...light);
    scene.add(sun);
  }
  const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
  camera.position.z = 5;
  const target = new (THREE.WebGLRenderTarget ?? THREE.RenderTarget)(width, height, { type: THREE.FloatType });
  renderer.setRenderTarget(target);
  return { renderer, target, draw: () => renderer.render(scene, camera) };
}

export async function picture(task) {
  const { renderer, target, draw } = await plane(task);
  draw();
  return encoded(await pixelsOf(renderer, target));
}

export async function frame(task) {
  const { renderer, target, draw } = await plane(task);
  return timed(renderer, target, draw, task.draws);
}
