// A picture of few frames without its noise, for as long as it has any.
//
// An edge-avoiding wavelet (Dammertz et al. 2010): passes of 3 x 3 pixels further and further apart,
// which keep to one surface, to like normals, and to like colors, as far as noise lets these be told
// apart. It fades as frames come in: what is converged is shown as it is.

import { HEAD, WHOLE } from "./webgl.js";

const STRIDES = [0, 1, 2, 4, 8]; // of passes; the first one only prepares
const FADES = [96, 224]; // pairs of directions between which the filter fades
const LONELY = 40; // pairs up to which single pixels are not believed
const NOISE = 1.1; // of one pair at middle brightness, as shown: what differs by more is kept apart

const PASS = `${HEAD}
uniform sampler2D sums, normals, source, gains;
uniform int stride;
uniform bool first, last, lonely;
uniform float sigma, rest, exposure, count;
out vec4 color;
const vec3 LUMA = vec3(0.2126, 0.7152, 0.0722);

vec3 raw(ivec2 at) {
  vec4 sum = texelFetch(sums, at, 0);
  return sum.rgb / max(sum.a, 1.0) * exposure * texelFetch(gains, ivec2(0), 0).r;
}

// Bells in few instructions.
float bell(float x) {
  float y = max(1.0 - 0.25 * x * x, 0.0);
  return y * y * y * y;
}

float alike(vec3 a, vec3 b) {
  float c = max(dot(a, b), 0.0);
  c *= c;
  c *= c;
  c *= c;
  c *= c;
  c *= c;
  return c;
}

// Bounded, so that no single bright direction spreads, and not negative, as few shadow rays may make it;
// the fourth number is what is seen.
vec4 bounded(ivec2 at) {
  vec3 c = max(raw(at), 0.0);
  return vec4(c / (1.0 + dot(c, LUMA)), texelFetch(normals, at, 0).w);
}

// Within what its neighbors show, but for the brightest and the darkest of them: lone dots are noise.
vec3 among(ivec2 at, ivec2 end, vec4 c) {
  vec3 low = vec3(1.0), second = vec3(1.0), high = vec3(0.0), next = vec3(0.0);
  int count = 0;
  for (int j = -1; j <= 1; j++)
    for (int i = -1; i <= 1; i++) {
      if (i == 0 && j == 0) continue;
      vec4 there = bounded(clamp(at + ivec2(i, j), ivec2(0), end));
      if (there.w != c.w) continue;
      count++;
      second = min(second, max(low, there.rgb));
      low = min(low, there.rgb);
      next = max(next, min(high, there.rgb));
      high = max(high, there.rgb);
    }
  return count < 5 ? c.rgb : clamp(c.rgb, second, max(next, second));
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), end = textureSize(sums, 0) - 1;
  if (first) {
    vec4 c = bounded(at);
    if (lonely) c.rgb = among(at, end, c);
    color = c;
    return;
  }
  vec4 here = texelFetch(source, at, 0);
  vec3 n = here.w == 0.0 ? vec3(0.0) : texelFetch(normals, at, 0).xyz, total = here.rgb * 0.25;
  float weights = 0.25;
  for (int j = -1; j <= 1; j++)
    for (int i = -1; i <= 1; i++) {
      ivec2 to = at + stride * ivec2(i, j);
      if ((i == 0 && j == 0) || to != clamp(to, ivec2(0), end)) continue;
      vec4 there = texelFetch(source, to, 0);
      if (there.w != here.w) continue;
      float weight = (i == 0 || j == 0 ? 0.125 : 0.0625) * bell(dot(abs(there.rgb - here.rgb), LUMA) / (sigma * (0.6 + 2.0 * dot(max(there.rgb, here.rgb), LUMA))));
      if (here.w != 0.0) weight *= alike(texelFetch(normals, to, 0).xyz, n);
      total += weight * there.rgb;
      weights += weight;
    }
  vec3 found = total / weights;
  if (last) {
    found /= max(1.0 - dot(found, LUMA), 1e-3);
    found = mix(found, raw(at), rest) / exposure / texelFetch(gains, ivec2(0), 0).r * count;
  }
  color = vec4(found, last ? count : here.w);
}`;

export class Smoothing {
  constructor(context) {
    this.context = context;
  }

  // The target of a sum after `drawn` pairs, smoothed; the sum's own once it needs nothing.
  of(sum, normals, drawn, { exposure, gains }) {
    const { context } = this, rest = (drawn - FADES[0]) / (FADES[1] - FADES[0]);
    if (rest >= 1) return sum;
    if (`${this.targets?.[0].size}` !== `${context.size}`) {
      this.free();
      this.targets = [0, 1].map(() => context.target(1, context.size));
    }
    const program = context.program(WHOLE, PASS);
    STRIDES.forEach((stride, k) => {
      const [to, from] = k % 2 ? [...this.targets].reverse() : this.targets;
      context.fill(to, program, {
        sums: sum.textures[0], normals, source: from.textures[0], stride, first: k === 0, lonely: drawn < LONELY, last: k === STRIDES.length - 1,
        sigma: NOISE / Math.sqrt(drawn) / Math.max(k, 1), rest: Math.max(rest, 0), exposure, gains, count: drawn,
      });
    });
    return this.targets[(STRIDES.length + 1) % 2];
  }

  free() {
    this.targets?.forEach((each) => this.context.free(each));
    this.targets = null;
  }
}
