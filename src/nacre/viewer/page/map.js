// Materials on a map, and a marker between them that is dragged or moved with the arrow keys.

import { drawn, held, keyed, placeIn } from "./dom.js";

const EDGE = 300, NEIGHBORS = 6, STEP = 0.02;
const HELP = "Place on the map: drag it, or move it with the arrow keys";
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

// How much each of the nearest materials contributes at a place, as pairs of its index and a weight; weights
// sum to 1. They are those of Franke and Little (see Franke 1982): 1 at a material, and 0 for a neighbor
// that is just gained or lost, so that nothing jumps.
export function weightsAt(places, [x, y]) {
  const near = places.map(([a, b], k) => [k, Math.hypot(a - x, b - y)]).sort((a, b) => a[1] - b[1]);
  if (near[0][1] < 1e-6) return [[near[0][0], 1]];
  const among = near.slice(0, Math.min(NEIGHBORS, near.length - 1)), reach = near[among.length][1];
  const parts = among.map(([k, distance]) => [k, (1 / distance - 1 / reach) ** 2]).filter(([, part]) => part > 0);
  if (!parts.length) return [[near[0][0], 1]];
  const sum = parts.reduce((total, [, part]) => total + part, 0);
  return parts.map(([k, part]) => [k, part / sum]);
}

export class Map2d {
  // `materials` are {name, picture (URL or empty)}; `change` is called with a place, `choose` with the
  // number of a material.
  constructor(places, materials, edge, change, choose) {
    this.lines = drawn("g", { class: "ties" });
    this.spheres = materials.map(({ name, picture }, k) => this.sphere(places[k], name, picture, edge, () => choose(k)));
    this.marker = drawn("g", { class: "marker", role: "button", tabindex: 0, "aria-label": HELP },
      drawn("circle", { r: 9 }), drawn("circle", { r: 2 }));
    const facts = { class: "map", viewBox: `0 0 ${EDGE} ${EDGE}`, role: "group", "aria-label": "Map of materials" };
    this.svg = drawn("svg", facts,
      drawn("rect", { width: EDGE, height: EDGE, rx: 6 }), ...this.spheres, this.lines, this.marker);
    const go = (e) => change(placeIn(this.svg, e));
    held(this.svg, go, (e) => {
      if (e.target.closest(".sphere")) return false;
      e.preventDefault();
      this.marker.focus();
      go(e);
    });
    keyed(this.marker, KEYS, (steps) => change(steps.map((step, k) => this.place[k] + STEP * step)));
    this.places = places;
  }

  sphere([x, y], name, picture, edge, choose) {
    const size = EDGE * edge, at = { x: EDGE * x - size / 2, y: EDGE * y - size / 2, width: size, height: size };
    const found = drawn("g", { class: "sphere" }, drawn("title", {}, name),
      drawn("circle", { cx: EDGE * x, cy: EDGE * y, r: size / 2 }));
    if (picture) found.append(drawn("image", { ...at, href: picture }));
    found.addEventListener("click", choose);
    return found;
  }

  // Put the marker somewhere, tied to materials by their weights.
  show(place, weights) {
    this.place = place;
    const [x, y] = place.map((value) => EDGE * value);
    this.marker.setAttribute("transform", `translate(${x} ${y})`);
    this.lines.replaceChildren(...weights.map(([k, weight]) => {
      const [a, b] = this.places[k].map((value) => EDGE * value);
      return drawn("line", { x1: x, y1: y, x2: a, y2: b, "stroke-width": 1 + 5 * weight });
    }));
  }
}
