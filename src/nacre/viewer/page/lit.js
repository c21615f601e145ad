// The shader that lights points of a shape, or of a stage.

import { BASE, STAGE } from "./stage_shaders.js";
import { HEAD } from "./webgl.js";

// Light on the points, added to the sums of earlier frames: half of the directions follow the light
// and half the material, weighted by the balance heuristic (Veach and Guibas 1995). The fourth sum
// counts directions. Places in the unit cube are an additive recurrence (Roberts 2018) whose start
// differs from pixel to pixel.
//
// On a stage (see stage_shaders.js) bodies cast shadows. The ground's light is known where nothing
// stands; only what bodies take from it is drawn, so that there is no noise where there is no shadow.
export const LIT = (material) => `${HEAD}
${material}
${STAGE}
uniform sampler2D before, normals, tangents, points, texels, toward, radiance;
uniform uint drawn;       // pairs of directions that earlier frames drew
uniform int pairs;        // that this frame draws
uniform vec2 spin;        // cosine and sine of the environment's rotation about +y
uniform vec4 lamp;        // where it is, or toward it where the fourth number is 0
uniform vec3 irradiance;  // of the lamp at distance 1, or across its rays
uniform float surroundings;
out vec4 color;
const float PI = 3.14159265358979;

uint scattered(uint x) {  // PCG of O'Neill 2014
  x = x * 747796405u + 2891336453u;
  x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
  return (x >> 22u) ^ x;
}

vec3 turned(vec3 w, vec2 by) {
  return vec3(by.x * w.x + by.y * w.z, w.y, by.x * w.z - by.y * w.x);
}

vec4 texel(ivec2 at, ivec2 size) {
  return texelFetch(texels, ivec2((at.x % size.x + size.x) % size.x, clamp(at.y, 0, size.y - 1)), 0);
}

// Radiance from a direction, and the density with which it is drawn.
vec4 seen(vec3 w) {
  vec3 d = turned(w, vec2(spin.x, -spin.y));
  ivec2 size = textureSize(texels, 0);
  vec2 at = vec2(atan(d.x, -d.z) / (2.0 * PI) * float(size.x) - 0.5,
                 acos(clamp(d.y, -1.0, 1.0)) / PI * float(size.y - 1));
  ivec2 low = ivec2(floor(at));
  vec2 part = at - vec2(low);
  vec3 from = mix(mix(texel(low, size).rgb, texel(low + ivec2(1, 0), size).rgb, part.x),
                  mix(texel(low + ivec2(0, 1), size).rgb, texel(low + ivec2(1, 1), size).rgb, part.x), part.y);
  return vec4(from, texel(ivec2(floor(at + 0.5)), size).a);
}

vec4 drawn_light(uint first, uint index, uint many) {
  uint place = (first + index) % (many * many);
  return texelFetch(toward, ivec2(place % many, place / many), 0);
}

vec3 drawn_radiance(uint first, uint index, uint many) {
  uint place = (first + index) % (many * many);
  return texelFetch(radiance, ivec2(place % many, place / many), 0).rgb;
}

// Of the lamp on a surface that faces it, and toward it.
vec3 lamplight(vec3 p, out vec3 way) {
  way = lamp.xyz - lamp.w * p;
  float squared = dot(way, way);
  way *= inversesqrt(squared);
  return irradiance / mix(1.0, squared, lamp.w);
}

// Whether the lamp is below the ground.
bool under() {
  return lamp.y < (lamp.w == 1.0 ? FLOOR : 0.0);
}

// Of matte surfaces of the stage, for all pairs.
vec3 matte(vec3 p, vec3 n, bool floor, uint first, uint many) {
  vec3 total = floor ? paper * float(pairs) : vec3(0.0);
  for (int k = 0; k < pairs; k++) {
    vec4 found = drawn_light(first, drawn + uint(k), many);
    vec3 w = turned(found.xyz, spin);
    float cosine = dot(w, n);
    if (cosine <= 0.0) continue;
    bool hidden = floor ? behind_something(p, w) : bodied > 0 && behind_sphere(p, w, bodies[0]);
    if (hidden != floor) continue;
    vec3 part = surroundings * drawn_radiance(first, drawn + uint(k), many) * cosine / found.w;
    total += (floor ? -PAPER / PI : plastic(n, w, normalize(eye.xyz - p))) * part;
  }
  vec3 way, light = lamplight(p, way);
  float cosine = dot(way, n);
  if (cosine > 0.0 && !under() && !behind_something(p, way)) total += float(pairs) * (floor ? PAPER / PI : plastic(n, way, normalize(eye.xyz - p))) * light * cosine;
  return total;
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(before, at, 0), n = texelFetch(normals, at, 0);
  uint first = scattered(uint(at.x) + 65536u * uint(at.y)), many = uint(textureSize(toward, 0).x);
  if (n.w != 1.0) {
    color = sum;
    if (!staged) return;
    vec3 total;
    if (n.w == ${BASE}.0) total = matte(texelFetch(points, at, 0).xyz, n.xyz, false, first, many);
    else {
      vec3 way = sight(gl_FragCoord.xy, vec2(textureSize(normals, 0)));
      float reach = way.y < -1e-3 ? (FLOOR - eye.y) / way.y : 1e3;
      vec3 p = eye.xyz + reach * way;
      float away = length(p.xz);
      total = away < 12.0 ? matte(p, vec3(0.0, 1.0, 0.0), true, first, many) : paper * float(pairs);
      total *= distant(away) * mix(1.0, 0.72, smoothstep(-0.05, 0.4, way.y));
    }
    color += vec4(total, float(pairs));
    return;
  }
  vec3 t = texelFetch(tangents, at, 0).xyz, p = texelFetch(points, at, 0).xyz;
  mat3 local = mat3(t, cross(n.xyz, t), n.xyz);
  vec3 wo = normalize(eye.xyz - eye.w * p) * local;
  vec3 total = vec3(0.0);
  if (wo.z > 0.0) {
    uvec3 start = uvec3(scattered(first + 1u), scattered(first + 2u), scattered(first + 3u));
    for (int k = 0; k < 2 * pairs; k++) {
      uint index = drawn + uint(k >> 1);
      vec3 wi;
      vec4 light;
      if ((k & 1) == 0) {
        vec4 found = drawn_light(first, index, many);
        wi = turned(found.xyz, spin) * local;
        if (wi.z <= 0.0) continue;
        light = vec4(drawn_radiance(first, index, many), found.w);
      } else {
        uvec3 u = start + index * uvec3(3518319155u, 2882110345u, 2360945575u);
        vec4 found = material_sample(wo, vec3(u >> 8u) * (1.0 / 16777216.0));
        if (!(found.w > 0.0)) continue;
        wi = found.xyz;
        if (wi.z <= 0.0) continue;
        light = seen(local * wi);
      }
      light.rgb = arriving(p, local * wi, surroundings * light.rgb);
      total += light.rgb * material_eval(wi, wo) * wi.z
          / (light.a + max(material_pdf(wi, wo), 0.0));
    }
    vec3 way, light = lamplight(p, way), wi = way * local;
    if (wi.z > 0.0 && light.r + light.g + light.b > 0.0 && !(staged && (under() || in_groove(p, way) || behind_base(p, way))))
      total += float(pairs) * light * material_eval(wi, wo) * wi.z;
  }
  color = sum + vec4(total, float(pairs));
}`;
