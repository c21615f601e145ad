// The LDR-FLIP map of two pictures at 67 pixels a degree (Andersson et al. 2020, "FLIP: A Difference
// Evaluator for Alternating Images"), as nacre.metrics.flip computes it: of values with nacre's gamma,
// black where nothing is. Filters are applied across, then down; edges of the picture are repeated.

import { HEAD, WHOLE } from "./webgl.js";

const PER_DEGREE = 67;
const TAPS = 21; // the widest filter ends at three deviations

// A sum as nacre compares it: exposed, clipped, with a gamma of 2.2.
export const TONED = `
vec3 toned(vec4 sum, float exposure, float count) {
  return pow(clamp(sum.rgb / max(count, 1.0) * exposure, 0.0, 1.0), vec3(1.0 / 2.2));
}`;

// From linear Rec. 709 to XYZ over that of white.
const TO_XYZ = `
const mat3 TO_XYZ = transpose(mat3(
  vec3(10135552, 8788810, 4435075) / 23359437.0,
  vec3(2613072, 8788810, 887015) / 12288897.0,
  vec3(1425312, 8788810, 70074185) / 80288307.0));`;

const OPPONENT = `${HEAD}
${TONED}
uniform sampler2D sums;
uniform float exposure, count;
layout(location = 0) out vec4 shown;
layout(location = 1) out vec4 opponent;
${TO_XYZ}
void main() {
  vec4 sum = texelFetch(sums, ivec2(gl_FragCoord.xy), 0);
  vec3 c = toned(sum, exposure, count);
  shown = vec4(c, sum.a > 0.0 ? 1.0 : 0.0);
  vec3 linear = mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
  vec3 w = TO_XYZ * linear;
  opponent = vec4(116.0 * w.y - 16.0, 500.0 * (w.x - w.y), 200.0 * (w.y - w.z), 1.0);
}`;

// Weights of the color filters (luminance, red-green, and the two parts of blue-yellow) and of those
// that find features (smoothing, edges, points).
const WEIGHTS = weights();

const ACROSS = `${HEAD}
${WEIGHTS}
uniform sampler2D opponent;
layout(location = 0) out vec4 colors;
layout(location = 1) out vec4 features;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  int last = textureSize(opponent, 0).x - 1;
  colors = vec4(0.0);
  features = vec4(0.0);
  for (int k = 0; k < ${TAPS}; k++) {
    vec3 o = texelFetch(opponent, ivec2(clamp(at.x + k - ${TAPS >> 1}, 0, last), at.y), 0).xyz;
    colors += COLOR[k] * o.xyzz;
    features.xyz += FEATURE[k] * (o.x + 16.0) / 116.0;
  }
}`;

const DIFFERENCE = `${HEAD}
${WEIGHTS}
uniform sampler2D colors, features, other_colors, other_features;
out vec4 map;
${TO_XYZ}

// L*a*b*, with less chroma where it is dark (Hunt effect).
vec3 perceived(vec3 linear) {
  vec3 w = TO_XYZ * linear;
  vec3 f = mix(w * 841.0 / 108.0 + 4.0 / 29.0, pow(w, vec3(1.0 / 3.0)), step(216.0 / 24389.0, w));
  float lightness = 116.0 * f.y - 16.0;
  return vec3(lightness, 0.01 * lightness * vec2(500.0 * (f.x - f.y), 200.0 * (f.y - f.z)));
}

float apart(vec3 a, vec3 b) {
  return pow(abs(a.x - b.x) + distance(a.yz, b.yz), 0.7);
}

// The perceived color at a texel, and how much of an edge and of a point it is.
void seen(sampler2D colors, sampler2D features, out vec3 color, out vec2 strength) {
  ivec2 at = ivec2(gl_FragCoord.xy);
  int last = textureSize(colors, 0).y - 1;
  vec4 c = vec4(0.0);
  vec2 edge = vec2(0.0), point = vec2(0.0);
  for (int k = 0; k < ${TAPS}; k++) {
    ivec2 from = ivec2(at.x, clamp(at.y + k - ${TAPS >> 1}, 0, last));
    vec3 f = texelFetch(features, from, 0).xyz, w = FEATURE[k];
    c += COLOR[k] * texelFetch(colors, from, 0);
    edge += vec2(w.x * f.y, w.y * f.x);
    point += vec2(w.x * f.z, w.z * f.x);
  }
  float y = (c.x + 16.0) / 116.0;
  vec3 linear = inverse(TO_XYZ) * vec3(c.y / 500.0 + y, y, y - (c.z + c.w) / 200.0);
  color = perceived(clamp(linear, 0.0, 1.0));
  strength = vec2(length(edge), length(point));
}

void main() {
  vec3 color, other;
  vec2 strength, others;
  seen(colors, features, color, strength);
  seen(other_colors, other_features, other, others);
  float most = apart(perceived(vec3(0.0, 1.0, 0.0)), perceived(vec3(0.0, 0.0, 1.0)));
  float bend = 0.4 * most, off = apart(color, other);
  float error = off < bend ? 0.95 * off / bend : 0.95 + 0.05 * (off - bend) / (most - bend);
  vec2 more = abs(strength - others);
  float feature = sqrt(max(more.x, more.y) * inversesqrt(2.0));
  // Where colors are equal, square roots and powers of 0 are that only nearly.
  map = vec4(error > 1e-9 ? pow(error, 1.0 - feature) : 0.0, 0.0, 0.0, 1.0);
}`;

export class Flip {
  constructor(context, size) {
    Object.assign(this, { context, size });
    this.pictures = [0, 1].map(() => ({ toned: context.target(2, size), across: context.target(2, size) }));
    this.map = context.target(1, size);
  }

  // Compare textures of sums; the map's first channel is the error in [0, 1].
  update(pair, exposure, count) {
    const { context, pictures } = this;
    pair.forEach((sums, k) => {
      const { toned, across } = pictures[k];
      context.fill(toned, context.program(WHOLE, OPPONENT), { sums, exposure, count });
      context.fill(across, context.program(WHOLE, ACROSS), { opponent: toned.textures[1] });
    });
    const [[colors, features], [otherColors, otherFeatures]] = pictures.map(({ across }) => across.textures);
    context.fill(this.map, context.program(WHOLE, DIFFERENCE), {
      colors, features, other_colors: otherColors, other_features: otherFeatures,
    });
  }

  // {toned: four numbers a pixel of either picture, the fourth 1 where something is; map: likewise}.
  read() {
    const { context } = this;
    return { toned: this.pictures.map(({ toned }) => context.read(toned)), map: context.read(this.map) };
  }

  free() {
    for (const { toned, across } of this.pictures) [toned, across].forEach((target) => this.context.free(target));
    this.context.free(this.map);
  }
}

function weights() {
  const places = Array.from({ length: TAPS }, (_, k) => k - (TAPS >> 1)), square = Math.PI ** 2;
  const gauss = (b) => places.map((x) => Math.exp((-square * (x / PER_DEGREE) ** 2) / b));
  const sum = (values) => values.reduce((a, b) => a + b, 0);
  const over = (values, by) => values.map((value) => value / by);
  const [light, red] = [0.0047, 0.0053].map(gauss).map((values) => over(values, sum(values)));
  const parts = [[34.1, 0.04], [13.5, 0.025]].map(([a, b]) => gauss(b).map((x) => x * Math.sqrt(a * Math.sqrt(Math.PI / b))));
  const [blue, yellow] = parts.map((values) => over(values, Math.hypot(...parts.map(sum))));

  const width = 0.5 * 0.082 * PER_DEGREE, inside = (x) => Math.abs(x) <= Math.ceil(3 * width);
  const bell = places.map((x) => (inside(x) ? Math.exp(-(x ** 2) / (2 * width ** 2)) : 0));
  // What is positive sums to 1, and what is negative to -1.
  const even = (values) => values.map((x) => x / Math.abs(sum(values.filter((y) => y * x > 0))) || 0);
  const edge = even(bell.map((g, k) => -places[k] * g));
  const point = even(bell.map((g, k) => ((places[k] / width) ** 2 - 1) * g));
  const table = (type, name, ...columns) => `const ${type} ${name}[${TAPS}] = ${type}[](${places.map((_, k) =>
    `${type}(${columns.map((values) => values[k].toExponential()).join(", ")})`).join(",\n  ")});\n`;
  return table("vec4", "COLOR", light, red, blue, yellow) + table("vec3", "FEATURE", over(bell, sum(bell)), edge, point);
}
