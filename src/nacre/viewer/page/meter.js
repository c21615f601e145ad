// The exposure that suits a material: dark ones are shown lighter and light ones darker, but not as much as
// would make them alike, nor as would make the ground too bright.
//
// It depends on the material and the environment alone, whatever else is chosen, so that lamps brighten
// pictures and turning does not. It stays on the graphics card: reading it would stall.

import { SPHERE } from "./shaders.js";
import { HEAD, WHOLE } from "./webgl.js";

const SIZE = 24, FRAMES = 8; // of a small sphere
const UPRIGHT = [1, 0, 0, 0, 1, 0, 0, 0, 1];
const NONE = { irradiance: [0, 0, 0], lamp: [0, 0, 1, 0], spin: [1, 0], surroundings: 1, staged: false, eye: [0, 0, 1, 0] };

const GAIN = `${HEAD}
uniform sampler2D sums;
uniform float ground;
out vec4 color;
void main() {
  float total = 0.0, count = 0.0;
  for (int k = 0; k < ${SIZE * SIZE}; k++) {
    vec4 sum = texelFetch(sums, ivec2(k % ${SIZE}, k / ${SIZE}), 0);
    if (sum.a == 0.0) continue;
    total += log(dot(sum.rgb / sum.a, vec3(0.2126, 0.7152, 0.0722)) + 1e-3);
    count += 1.0;
  }
  color = vec4(clamp(pow(0.36 / exp(total / max(count, 1.0)), 0.4), 0.6, min(1.7, 0.6 / max(ground, 0.01))));
}`;

export class Meter {
  constructor(context) {
    Object.assign(this, { context, gains: new Map() });
    this.one = context.texture([1, 1], new Float32Array(4).fill(1));
  }

  // A texture of one texel for a picture's material in an environment, in which the ground has a luminance.
  of({ program, textures }, environment, ground) {
    const { gains } = this;
    if (!gains.has(program)) gains.set(program, this.metered(program, { ...environment, ...textures }, ground));
    return gains.get(program).textures[0];
  }

  metered(program, light, ground) {
    const { context } = this, size = [SIZE, SIZE], points = context.target(3, size, true), sums = [0, 1].map(() => context.target(1, size));
    const [normals, tangents, where] = points.textures, found = context.target(1, [1, 1]);
    let latest;
    context.clear(points);
    context.fill(points, context.program(WHOLE, SPHERE), { turn: UPRIGHT, shift: [0, 0], scale: 0.97, size });
    for (let frame = 0; frame < FRAMES; frame++)
      latest = context.added(sums, frame, program, { normals, tangents, points: where, ...light, ...NONE, drawn: 2 * frame, pairs: 2 });
    context.fill(found, context.program(WHOLE, GAIN), { sums: latest.textures[0], ground });
    for (const each of [points, ...sums]) context.free(each);
    return found;
  }

  // Another environment: measure anew.
  forget() {
    for (const each of this.gains.values()) this.context.free(each);
    this.gains.clear();
  }
}
