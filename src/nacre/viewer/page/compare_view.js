// Two pictures on the canvas: a wipe between them, their differences, or all of these side by side.

import { TONED } from "./flip.js";
import { PRESENTED } from "./shaders.js";
import { HEAD, WHOLE } from "./webgl.js";

// The numbers by which the shader knows them.
export const VIEWS = { Wipe: 0, "Side by side": 1, Difference: 2, FLIP: 3 };

// Matplotlib's "magma" at steps of 1/16.
const MAGMA = (
  "000004 0a0822 1d1146 36106a 50127c 691c81 822681 9c2e7f b63779 " +
  "cf4170 e65163 f5695c fb8761 fea571 fec387 fde0a2 fcfdbf"
).split(" ");
const COLORS = MAGMA.map((hex) =>
  `vec3(${[0, 2, 4].map((k) => (parseInt(hex.slice(k, k + 2), 16) / 255).toFixed(4)).join(", ")})`);

export const RAMP = `linear-gradient(90deg, ${MAGMA.map((hex) => `#${hex}`).join(", ")})`;

const VIEWED = `${HEAD}
${PRESENTED}
${TONED}
uniform sampler2D first, second, map;
uniform int view;
uniform float wipe, factor;
out vec4 color;
const vec3 MAGMA[17] = vec3[](${COLORS.join(", ")});
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), size = textureSize(first, 0);
  int shown = view;
  if (view == ${VIEWS["Side by side"]}) {
    ivec2 cell = at / size;
    at -= cell * size;
    shown = 2 * (1 - cell.y) + cell.x;
  } else if (view == ${VIEWS.Wipe}) shown = float(at.x) + 0.5 < wipe * float(size.x) ? 0 : 1;
  vec4 a = texelFetch(first, at, 0), b = texelFetch(second, at, 0);
  if (shown < 2) color = presented(shown == 0 ? a : b);
  else if (shown == 2) color = vec4(factor * abs(toned(a, exposure, count) - toned(b, exposure, count)), 1.0);
  else {
    float place = 16.0 * clamp(texelFetch(map, at, 0).r, 0.0, 1.0);
    int low = min(int(place), 15);
    color = vec4(mix(MAGMA[low], MAGMA[low + 1], place - float(low)), 1.0);
  }
}`;

// Show two pictures' sums and their FLIP map; side by side, the canvas holds four.
export function view(renderer, [first, second], map, { view, wipe, factor }) {
  const { canvas, size, drawn, scene: { exposure, ground, backing } } = renderer, edge = view === VIEWS["Side by side"] ? 2 : 1;
  fit(canvas, size.map((length) => edge * length));
  const values = { first, second, map, view, wipe, factor, exposure, ground, backing, count: drawn };
  renderer.fill(null, renderer.program(WHOLE, VIEWED), values);
}

export function fit(canvas, [width, height]) {
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
}
