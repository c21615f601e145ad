// Functions of a material's module in pages with three.js, with either renderer.

import { encoded, given } from "/shared.js";
import { pixelsOf, rendererOf } from "/scene.js";

const CALLS = {
  eval: { result: "vec3", parameters: ["wi", "wo"], color: "vec4(value, 0.0)" },
  sample: { result: "vec4", parameters: ["wo", "u"], color: "value" },
  pdf: { result: "float", parameters: ["wi", "wo"], color: "vec4(value, 0.0, 0.0, 0.0)" },
};

function glslMaterial(THREE, { glsl, name }, call, first, second) {
  const { result, color } = CALLS[call];
  return new THREE.ShaderMaterial({
    uniforms: { first: { value: first }, second: { value: second } },
    vertexShader: "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }",
    fragmentShader: `uniform sampler2D first, second;
      ${glsl}
      void main() {
        ivec2 place = ivec2(gl_FragCoord.x, float(textureSize(first, 0).y) - gl_FragCoord.y);
        ${result} value = ${name}_${call}(texelFetch(first, place, 0).xyz, texelFetch(second, place, 0).xyz);
        gl_FragColor = ${color};
      }`,
    toneMapped: false,
  });
}

function wgslMaterial(THREE, { wgsl, name }, call, first, second) {
  const { code, ivec2, screenCoordinate, textureLoad, vec4, wgslFn } = THREE.TSL;
  const { result, parameters } = CALLS[call];
  const type = result === "float" ? "f32" : `${result}f`;
  const [a, b] = parameters;
  const run = wgslFn(
    `fn run(${a}: vec3f, ${b}: vec3f) -> ${type} { return ${name}_${call}(${a}, ${b}); }`,
    [code(wgsl, [], "wgsl")],
  );
  const place = ivec2(screenCoordinate);
  const value = run(textureLoad(first, place).xyz, textureLoad(second, place).xyz);
  const material = new THREE.NodeMaterial();
  material.fragmentNode = { eval: () => vec4(value, 0), sample: () => value, pdf: () => vec4(value, 0, 0, 0) }[call]();
  return material;
}

async function prepared({ renderer: kind, call, width, height }) {
  const THREE = await import(kind === "webgpu" ? "three/webgpu" : "three");
  const module = await import("/material.js");
  const renderer = await rendererOf(THREE);
  const textures = [];
  for (const name of ["first", "second"]) {
    const values = await given(name);
    textures.push(new THREE.DataTexture(values, width, height, THREE.RGBAFormat, THREE.FloatType));
    textures.at(-1).needsUpdate = true;
  }
  const make = kind === "webgpu" ? wgslMaterial : glslMaterial;
  const quad = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), make(THREE, module, call, ...textures));
  quad.frustumCulled = false;
  const options = { type: THREE.FloatType, depthBuffer: false };
  const target = new (THREE.WebGLRenderTarget ?? THREE.RenderTarget)(width, height, options);
  renderer.setRenderTarget(target);
  const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -1, 1);
  return { renderer, target, draw: () => renderer.render(quad, camera) };
}

export async function run(task) {
  const { renderer, target, draw } = await prepared(task);
  draw();
  return encoded(await pixelsOf(renderer, target));
}

export async function rate(task) {
  const { renderer, target, draw } = await prepared(task);
  const seconds = [];
  for (let i = 0; i <= task.draws; i++) {
    const start = performance.now();
    draw();
    await pixelsOf(renderer, target, 1, 1);
    seconds.push((performance.now() - start) / 1000);
  }
  return (task.width * task.height) / Math.min(...seconds.slice(1)); // the first one compiles
}
