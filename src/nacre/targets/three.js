NACRE_PREAMBLE
//
// A material for three.js. The module imports nothing; pages pass in the three.js that they use
// (written for and tested with NACRE_REVISION):
//
//     import * as THREE from "three";         // or "three/webgpu", for WebGPURenderer
//     import { createMaterial } from "./NACRE_NAME.js";
//     const mesh = new THREE.Mesh(geometry, createMaterial(THREE, { environment: texture }));
//
// Light comes from the directional, point and spot lights of the scene, with their shadows, from an
// equirectangular map, and from ambient light; rectangular area lights have no effect. Tone mapping
// and color space are those of the renderer. material.dispose() frees everything but the map.

export const name = "NACRE_NAME";
export const anisotropic = NACRE_ANISOTROPIC; // then meshes need uv coordinates, or tangents
export const arrays = NACRE_ARRAYS; // files and layers of arrays by name, if it is a texture

// The functions NACRE_NAME_eval, NACRE_NAME_sample and NACRE_NAME_pdf.
export const glsl = `NACRE_GLSL`;
export const wgsl = `NACRE_WGSL`;

// A material of either renderer.
//
// THREE        all of "three" for WebGLRenderer, or of "three/webgpu" for WebGPURenderer
// environment  equirectangular texture with linear values, best in half floats; it gets mipmaps
// environmentIntensity  factor of the environment
// samples      directions in which the surroundings are seen, for each pixel
// textures     for an encoded texture: the result of loadTextures; materials do not dispose of it
// parameters   other options of three.js materials, such as side
//
// The first three options are properties of the material as well.
export function createMaterial(THREE, options = {}) {
  const {
    environment = null, environmentIntensity = 1, samples = NACRE_SAMPLES, textures = {},
    ...parameters
  } = options;
  for (const each of Object.keys(arrays))
    if (!textures[each]) throw new Error(`${each} is missing: give textures: await loadTextures(THREE)`);
  const black = new THREE.DataTexture(new Uint8Array([0, 0, 0, 255]), 1, 1);
  black.needsUpdate = true;
  const values = { environment: black, environmentIntensity, samples };
  const create = THREE.NodeMaterial ? nodeMaterial : shaderMaterial;
  const { material, slots } = create(THREE, parameters, values, textures);
  material.name = name;
  material.addEventListener("dispose", () => black.dispose());
  for (const key of ["environmentIntensity", "samples"])
    Object.defineProperty(material, key, {
      get: () => slots[key].value,
      set: (value) => void (slots[key].value = value),
    });
  Object.defineProperty(material, "environment", {
    get: () => (slots.environment.value === black ? null : slots.environment.value),
    set: (texture) => void (slots.environment.value = texture ? mipmapped(THREE, texture) : black),
  });
  material.environment = environment;
  return material;
}

NACRE_LOADERfunction mipmapped(THREE, texture) {
  if (texture.minFilter !== THREE.LinearMipmapLinearFilter || !texture.generateMipmaps) {
    texture.generateMipmaps = true;
    texture.minFilter = THREE.LinearMipmapLinearFilter;
    texture.magFilter = THREE.LinearFilter;
    texture.wrapS = THREE.RepeatWrapping;
    texture.needsUpdate = true;
  }
  return texture;
}

// What follows is written twice: for WebGLRenderer in GLSL, for WebGPURenderer as nodes.
//
// The surroundings are seen in directions that the material draws. Each stands for a solid angle of
// 1 / (samples pdf), and reads the map at the mipmap whose texels are as large (Krivanek and
// Colbert, "Real-time Shading with Filtered Importance Sampling", 2008).

const fragment = `
varying vec3 vViewPosition;
uniform sampler2D environment;
uniform float environmentIntensity;
uniform int samples;

#include <common>
#include <packing>
#include <dithering_pars_fragment>
#include <uv_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <shadowmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>

${glsl}

struct Surface {
  mat3 frame; // tangent, bitangent and normal in view space
  vec3 wo;
};

Surface surfaceOf(vec3 normal, vec3 view) {
  vec3 tangent = vec3(0.0), bitangent = vec3(0.0);
  #ifdef USE_TANGENT
    tangent = vTangent;
    bitangent = vBitangent;
    if (!(dot(tangent, tangent) > 0.0)) { // the mesh has none
      vec3 x = cross(-dFdy(vViewPosition), normal), y = cross(normal, -dFdx(vViewPosition));
      tangent = x * dFdx(vUv).x + y * dFdy(vUv).x;
      bitangent = x * dFdx(vUv).y + y * dFdy(vUv).y;
    }
  #endif
  tangent -= dot(tangent, normal) * normal;
  if (!(dot(tangent, tangent) > 0.0))
    tangent = cross(abs(normal.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0), normal);
  tangent = normalize(tangent);
  vec3 across = cross(normal, tangent);
  mat3 frame = mat3(tangent, dot(across, bitangent) < 0.0 ? -across : across, normal);
  vec3 wo = view * frame;
  NACRE_BEGIN
  return Surface(frame, normalize(vec3(wo.xy, max(wo.z, 0.001))));
}

void lightDirectly(
  const in IncidentLight light, const in vec3 position, const in vec3 normal, const in vec3 view,
  const in vec3 clearcoat, const in Surface surface, inout ReflectedLight reflected
) {
  vec3 wi = light.direction * surface.frame;
  if (wi.z > 0.0) reflected.directSpecular += NACRE_NAME_eval(wi, surface.wo) * wi.z * light.color;
}

void lightAround(
  const in vec3 irradiance, const in vec3 position, const in vec3 normal, const in vec3 view,
  const in vec3 clearcoat, const in Surface surface, inout ReflectedLight reflected
) {
  vec2 size = vec2(textureSize(environment, 0));
  vec3 sum = vec3(0.0);
  for (int i = 0; i < samples; i++) {
    float k = float(i);
    vec3 u = vec3((k + 0.5) / float(samples), fract(0.5 + k * vec2(0.7548777, 0.5698403)));
    vec4 drawn = NACRE_NAME_sample(surface.wo, u);
    if (drawn.w <= 0.0) continue;
    vec3 direction = normalize((vec4(surface.frame * drawn.xyz, 0.0) * viewMatrix).xyz); // of the world
    float texels = size.x * size.y / (2.0 * PI * PI * max(sqrt(1.0 - direction.y * direction.y), 0.05));
    float level = 0.5 * log2(texels / (float(samples) * drawn.w));
    vec3 radiance = textureLod(environment, equirectUv(direction), max(level, 0.0)).rgb;
    radiance = radiance * environmentIntensity + irradiance * RECIPROCAL_PI;
    sum += NACRE_NAME_eval(drawn.xyz, surface.wo) * (drawn.z / drawn.w) * radiance;
  }
  reflected.indirectSpecular += sum / float(max(samples, 1));
}

#define RE_Direct lightDirectly
#define RE_IndirectDiffuse lightAround

void main() {
  #include <clipping_planes_fragment>
  #include <logdepthbuf_fragment>
  #include <normal_fragment_begin>
  ReflectedLight reflectedLight = ReflectedLight(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
  Surface material = surfaceOf(normal, isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(vViewPosition));
  #include <lights_fragment_begin>
  #include <lights_fragment_end>
  vec3 outgoingLight = reflectedLight.directSpecular + reflectedLight.indirectSpecular;
  vec4 diffuseColor = vec4(0.0, 0.0, 0.0, 1.0);
  #include <opaque_fragment>
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
  #include <fog_fragment>
  #include <premultiplied_alpha_fragment>
  #include <dithering_fragment>
}`;

function shaderMaterial(THREE, parameters, values, textures) {
  const slots = Object.fromEntries(Object.entries(values).map(([key, value]) => [key, { value }]));
  const { lights, fog } = THREE.UniformsLib;
  const arrayed = Object.fromEntries(Object.entries(textures).map(([key, value]) => [key, { value }]));
  const material = new THREE.ShaderMaterial({
    uniforms: Object.assign(THREE.UniformsUtils.merge([lights, fog]), slots, arrayed),
    defines: anisotropic ? { USE_TANGENT: "", USE_UV: "" } : {},
    vertexShader: THREE.ShaderLib.phong.vertexShader,
    fragmentShader: fragment,
    lights: true,
    fog: true,
    clipping: true,
    ...parameters,
  });
  return { material, slots };
}

function nodeMaterial(THREE, parameters, values, textures) {
  const {
    Fn, If, Loop, abs, bitangentView, bool, cameraWorldMatrix, code, cross, dFdx, dFdy, dot, equirectUV,
    float, fract, glslFn, log2, mat3, nodeObject, normalView: normal, positionViewDirection, select, tangentView, texture,
    textureSize, uniform, uv, vec2, vec3, wgslFn,
  } = THREE.TSL;
  const slots = {
    environment: texture(values.environment),
    environmentIntensity: uniform(values.environmentIntensity),
    samples: uniform(values.samples, "int"),
  };

  // Three.js calls a function of ours by its name in the shading language of the renderer.
  const functions = (builder, wo) => {
    const web = builder.renderer.backend.isWebGPUBackend === true;
    const text = arrayed.length ? glsl.replace(/^uniform .*$/gm, "") : glsl;
    const source = [code(web ? wgsl : text, [], web ? "wgsl" : "glsl")];
    const declared = (label, count, parameters) => {
      const names = Object.keys(parameters).join(", ");
      const type = (size) => `vec${size}${web ? "f" : ""}`;
      const head = Object.entries(parameters)
        .map(([key, size]) => (web ? `${key}: ${type(size)}` : `${type(size)} ${key}`))
        .join(", ");
      const run = web
        ? wgslFn(`fn ${label}_(${head}) -> ${type(count)} { return ${label}(${names}); }`, source)
        : glslFn(`${type(count)} ${label}_(${head}) { return ${label}(${names}); }`, source);
      return arrayed.length ? (...given) => nodeObject(new Reading(run(...given))) : run;
    };
    const more = arrayed.length ? { here: 3 } : {};
    const evaluate = declared("NACRE_NAME_eval", 3, { wi: 3, wo: 3, ...more });
    const draw = declared("NACRE_NAME_sample", 4, { wo: 3, u: 3, ...more });
    if (!arrayed.length) return { evaluate, draw };
    const begin = declared("NACRE_NAME_at_begin", 3, { uv: 2, along: 2, across: 2, wo: 3 });
    const place = uv();
    const here = begin(place, dFdx(place), dFdy(place), wo).toVar();
    return { evaluate: (wi, wo) => evaluate(wi, wo, here), draw: (wo, u) => draw(wo, u, here) };
  };

  // Functions read arrays by their names, under which three.js declares what is part of a node.
  const arrayed = Object.entries(textures).map(([key, value]) => texture(value).setName(key));

  class Reading extends THREE.Node {
    constructor(value) {
      super();
      Object.assign(this, { value, arrayed });
    }

    getNodeType(builder) {
      return this.value.getNodeType(builder);
    }

    generate(builder, output) {
      for (const each of this.arrayed) each.build(builder, "property");
      return this.value.build(builder, output);
    }
  }

  const surfaceOf = () => {
    const axis = select(abs(normal.y).lessThan(0.9), vec3(0, 1, 0), vec3(1, 0, 0));
    const any = cross(axis, normal);
    const along = anisotropic ? tangentView.sub(normal.mul(dot(tangentView, normal))) : any;
    const tangent = select(dot(along, along).greaterThan(0), along, any).normalize().toVar();
    const across = cross(normal, tangent).toVar();
    const mirrored = anisotropic ? dot(across, bitangentView).lessThan(0) : bool(false);
    const frame = mat3(tangent, select(mirrored, across.negate(), across), normal).toVar();
    const local = positionViewDirection.mul(frame).toVar();
    return { frame, wo: vec3(local.xy, local.z.max(0.001)).normalize().toVar() };
  };

  class Lighting extends THREE.LightingModel {
    start(builder) {
      const surface = surfaceOf();
      Object.assign(this, surface, functions(builder, surface.wo));
      super.start(builder);
    }

    direct({ lightDirection, lightColor, reflectedLight }) {
      const wi = lightDirection.mul(this.frame).toVar();
      const reflected = this.evaluate(wi, this.wo).mul(wi.z.max(0)).mul(lightColor);
      reflectedLight.directSpecular.addAssign(reflected);
    }

    indirect(builder) {
      const { irradiance, reflectedLight } = builder.context;
      const { environment, environmentIntensity, samples } = slots;
      const { draw, evaluate, frame, wo } = this;
      const around = Fn(() => {
        const size = vec2(textureSize(environment, 0)).toVar();
        const sum = vec3(0).toVar();
        Loop(samples, ({ i }) => {
          const k = float(i);
          const u = vec3(k.add(0.5).div(float(samples)), fract(k.mul(vec2(0.7548777, 0.5698403)).add(0.5)));
          const drawn = draw(wo, u).toVar();
          If(drawn.w.greaterThan(0), () => {
            const direction = frame.mul(drawn.xyz).transformDirection(cameraWorldMatrix).toVar();
            const height = float(1).sub(direction.y.mul(direction.y)).max(0).sqrt().max(0.05);
            const texels = size.x.mul(size.y).div(height.mul(2 * Math.PI * Math.PI));
            const level = log2(texels.div(float(samples).mul(drawn.w))).mul(0.5);
            const seen = environment.sample(equirectUV(direction)).level(level.max(0)).rgb;
            const radiance = seen.mul(environmentIntensity).add(irradiance.div(Math.PI));
            sum.addAssign(evaluate(drawn.xyz, wo).mul(drawn.z.div(drawn.w)).mul(radiance));
          });
        });
        return sum.div(float(samples).max(1));
      });
      reflectedLight.indirectSpecular.addAssign(around());
    }
  }

  class Material extends THREE.NodeMaterial {
    lights = true;

    setupLightingModel() {
      return new Lighting();
    }

    customProgramCacheKey() {
      return super.customProgramCacheKey() + this.uuid; // the slots are of this material alone
    }

    setupEnvironment() {
      return new THREE.IrradianceNode(vec3(0)); // or without lights nothing would be lit
    }
  }

  const material = new Material();
  material.setValues(parameters);
  return { material, slots };
}
