// A polar plot of values over the angles of a half-plane, with handles for the light and the view.

import { attributes, drawn, held, keyed, placeIn } from "./dom.js";

const WIDTH = 320, HEIGHT = 166, CENTER = [160, 142], RADIUS = 122, DEGREE = Math.PI / 180;
const SPOKES = [-90, -60, -30, 0, 30, 60, 90];
const APART = 0.24; // smallest distance of two rings, in radii
const DECADES = 3;

// The radius for a fraction of the peak: 0 at 0 and 1 at 1.
export const SCALES = {
  log: { title: `Log, ${DECADES} decades`, of: (t) => Math.log1p((10 ** DECADES - 1) * t) / Math.log(10 ** DECADES) },
  linear: { title: "Linear", of: (t) => t },
  root: { title: "Root", of: (t) => Math.sqrt(t) },
};

// A number in a few digits, as people write it.
export function rounded(x, digits) {
  if (x === 0 || !Number.isFinite(x)) return `${x}`;
  const power = Math.floor(Math.log10(Math.abs(x)));
  return power < -4 || power > 5 ? x.toExponential(digits - 1) : x.toFixed(Math.max(digits - 1 - power, 0));
}

// Values of rings from the peak down, 1, 2 or 5 times a power of ten.
function ringsOf(peak, scale) {
  const found = [];
  let last = 1.04;
  for (let power = Math.floor(Math.log10(peak)); found.length < 4 && peak > 0 && power > Math.log10(peak) - 6; power--)
    for (const digit of [5, 2, 1]) {
      const value = digit * 10 ** power, radius = value <= peak ? scale.of(value / peak) : 2;
      if (radius <= last - (found.length ? APART : 0) && radius > 0.15) {
        found.push({ value, radius });
        last = radius;
      }
    }
  return found;
}

const place = (angle, radius) => [CENTER[0] + RADIUS * radius * Math.sin(angle), CENTER[1] - RADIUS * radius * Math.cos(angle)];
const pair = ([x, y]) => `${x.toFixed(2)},${y.toFixed(2)}`;

export class Polar {
  // `change.light` and `change.view` are called with radians.
  constructor(change) {
    this.rings = drawn("g", { class: "rings" });
    this.curves = [0, 1, 2].map((c) => drawn("path", { class: `curve channel-${c}` }));
    this.mirror = drawn("line", { class: "mirror", x1: CENTER[0], y1: CENTER[1] });
    this.light = this.handle("light", "Light, degrees from the normal", (angle) => change.light(Math.max(-angle, 0)), -1);
    this.view = this.handle("view", "View, degrees from the normal", change.view, 1);
    const spokes = SPOKES.flatMap((degrees) => {
      const angle = degrees * DEGREE, [x, y] = place(angle, 1), [u, v] = place(angle, 1.1);
      return [
        drawn("line", { x1: CENTER[0], y1: CENTER[1], x2: x, y2: y }),
        drawn("text", { x: u, y: v + 4 }, `${Math.abs(degrees)}°`),
      ];
    });
    const facts = { class: "polar", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "group", "aria-label": "Polar plot in the plane of incidence" };
    this.svg = drawn("svg", facts,
      drawn("g", { class: "grid" }, arc(1), ...spokes), this.rings, this.mirror,
      drawn("g", { class: "curves" }, ...this.curves), this.view, this.light);
  }

  // A ray with a knob at its end; angles of the light count the other way.
  handle(name, label, change, sign) {
    const ray = drawn("line", { x1: CENTER[0], y1: CENTER[1] }), knob = drawn("circle", { r: 7 });
    const limits = { "aria-valuemin": sign < 0 ? 0 : -90, "aria-valuemax": 90 };
    const group = drawn("g", { class: `ray ${name}`, role: "slider", tabindex: 0, "aria-label": label, ...limits }, ray, knob);
    held(group, (e) => {
      const [x, y] = placeIn(this.svg, e);
      change(Math.atan2(WIDTH * x - CENTER[0], Math.max(CENTER[1] - HEIGHT * y, 1e-6)));
    }, (e) => {
      e.preventDefault();
      group.focus();
    });
    const steps = { ArrowRight: 1, ArrowUp: sign, ArrowLeft: -1, ArrowDown: -sign };
    keyed(group, steps, (step) => change(group.angle + step * DEGREE));
    group.point = (angle, radius) => {
      const [x, y] = place(angle, radius), degrees = (sign * angle) / DEGREE;
      group.angle = angle;
      attributes(ray, { x2: x, y2: y });
      attributes(knob, { cx: x, cy: y });
      attributes(group, { "aria-valuenow": Math.round(degrees), "aria-valuetext": `${degrees.toFixed(1)}°` });
    };
    return group;
  }

  // Values, three for each angle, as curves.
  draw({ angles, values, peak, scale, incidence, view }) {
    this.rings.replaceChildren(...ringsOf(peak, scale).flatMap(({ value, radius }) =>
      [arc(radius), drawn("text", { x: place(90 * DEGREE, radius)[0], y: CENTER[1] + 14 }, rounded(value, 1))]));
    this.curves.forEach((curve, c) => {
      const radius = (k) => (peak > 0 ? scale.of(Math.max(values[3 * k + c], 0) / peak) : 0);
      const points = Array.from(angles, (angle, k) => pair(place(angle, radius(k))));
      curve.setAttribute("d", `M${points.join("L")}`);
    });
    const [x2, y2] = place(incidence, 1);
    attributes(this.mirror, { x2, y2 });
    this.light.point(-incidence, 1);
    this.view.point(view, 1);
  }
}

function arc(radius) {
  const r = RADIUS * radius;
  return drawn("path", { d: `M${pair(place(-90 * DEGREE, radius))}A${r},${r} 0 0 1 ${pair(place(90 * DEGREE, radius))}` });
}
