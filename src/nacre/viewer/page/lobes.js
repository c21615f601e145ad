// The mode that shows where a material reflects light: in the plane of incidence, and all around.
//
// Directions are in the material's own frame, +z its normal. The light has a polar angle and an
// azimuth; in the plane of incidence views have an angle from the normal, positive on the side of the
// mirror direction, as in nacre.figures.lobes.

import { attempt, choice, element, keyed, made, range } from "./dom.js";
import { Hemisphere, nodes } from "./hemisphere.js";
import { Mode } from "./look.js";
import { Polar, SCALES, rounded } from "./polar.js";

const DEGREE = Math.PI / 180;
const HORIZON = 89.9 * DEGREE;
const STEP = 0.25 * DEGREE;
const FAN = Array.from({ length: 24 }, (_, k) => 0.005 * 2000 ** (k / 23) * DEGREE); // up to 10 degrees
const CHANNELS = ["R", "G", "B"];
const VALUES = [["cosine", "fᵣ cos θₒ, reflected light"], ["plain", "fᵣ, reflectance"]];
const COLORS = [["material", "Of the material"], ["channels", "By channel"]];
const HELP = "Light: drag it, or move it with the arrow keys";

// Angles of views in the plane of incidence, dense about the mirror direction and back to the light.
function anglesOf(incidence) {
  const around = [0, ...FAN, ...FAN.map((x) => -x)];
  const even = Array.from({ length: Math.floor((2 * HORIZON) / STEP) + 1 }, (_, k) => k * STEP - HORIZON);
  const all = [...even, HORIZON, ...around.flatMap((x) => [incidence + x, x - incidence])];
  return Float64Array.from(all.filter((x) => Math.abs(x) <= HORIZON)).sort();
}

const spherical = (theta, phi) =>
  [Math.sin(theta) * Math.cos(phi), Math.sin(theta) * Math.sin(phi), Math.cos(theta)];

export class Lobes extends Mode {
  constructor(page) {
    super(page, "Lobes");
    this.settings = { scale: "log", cosine: true, channels: false };
    this.light = { theta: 45 * DEGREE, phi: 135 * DEGREE };
    this.view = 45 * DEGREE;
    this.polar = new Polar({ light: (theta) => this.move({ theta }), view: (theta) => this.look(theta) });
    this.picture = new Hemisphere(page.renderer);
    this.inputs = {};
    this.table = made("table");
    this.panel = made("div", { className: "lobes" },
      this.polar.svg,
      made("div", { className: "settings" },
        this.angle("light", "Light θᵢ", 0, 89, (theta) => this.move({ theta })),
        this.angle("azimuth", "Light φᵢ", -180, 180, (phi) => this.move({ phi })),
        this.angle("view", "View θₒ", -89, 89, (theta) => this.look(theta)),
        choice("Values", VALUES, (name) => this.set({ cosine: name === "cosine" })),
        choice("Scale", Object.entries(SCALES).map(([name, { title }]) => [name, title]), (scale) => this.set({ scale })),
        choice("Colors", COLORS, (name) => this.set({ channels: name === "channels" }))),
      this.table);
    const facts = { className: "handle", type: "button", title: HELP, "aria-label": "Light", hidden: true };
    this.handle = made("button", facts);
    element("frame").append(this.handle);
    // The start of a drag decides where "right" and "down" lead: the light may pass the rim.
    for (const start of ["pointerdown", "keydown"]) this.handle.addEventListener(start, () => (this.ways = this.waysNow()));
    page.controls.dragged(this.handle, (across, down) => {
      const reach = element("picture").getBoundingClientRect().width / 2, [right, below] = this.ways;
      const theta = this.light.theta + (below * down) / reach, phi = this.light.phi + (right * across) / reach;
      this.move({ theta, phi });
    });
  }

  // The light is where the lamp is, seen from the middle of a sphere before us.
  open() {
    const [x, y, z] = this.page.renderer.scene.lamp;
    this.light = { theta: Math.min(Math.atan2(Math.hypot(x, y), z), 89 * DEGREE), phi: Math.atan2(y, x) };
    this.moved = false;
    this.handle.hidden = false;
    this.changed();
  }

  close() {
    this.handle.hidden = true;
    super.close();
    const [x, y] = spherical(this.light.theta, this.light.phi);
    if (this.moved) this.page.controls.move(x, y);
  }

  changed() {
    const { chosen, form } = this.page;
    element("picture").setAttribute("aria-label", `Lobe of ${chosen.name}, ${form.label}; arrow keys turn it`);
    this.material = this.page.materials.shown(this.page.form);
    this.measure();
  }

  lit(change) {
    if (change.turn) this.turned = true;
  }

  set(change) {
    Object.assign(this.settings, change);
    this.scaled();
  }

  move(change) {
    Object.assign(this.light, change);
    this.light.theta = Math.min(Math.max(this.light.theta, 0), 89 * DEGREE);
    this.light.phi = Math.atan2(Math.sin(this.light.phi), Math.cos(this.light.phi));
    this.moved = this.old = true;
  }

  look(theta) {
    this.view = Math.min(Math.max(theta, -HORIZON), HORIZON);
    this.old = true;
  }

  draw() {
    if (this.old) this.measure();
    if (this.turned) this.paint();
    return "";
  }

  // Reflectance in the plane and at the nodes of the hemisphere, in one call.
  measure() {
    const { light: { theta, phi }, page: { renderer } } = this;
    const angles = Float64Array.from([this.view, ...anglesOf(theta)]), around = nodes(theta, phi + Math.PI);
    const wo = new Float32Array(3 * angles.length + around.directions.length);
    angles.forEach((angle, k) => wo.set(spherical(angle, phi + Math.PI), 3 * k));
    wo.set(around.directions, 3 * angles.length);
    const wi = new Float32Array(wo.length), from = spherical(theta, phi);
    for (let k = 0; k < wi.length; k += 3) wi.set(from, k);
    const found = renderer.values(this.material, wi, wo);
    const rgb = new Float32Array(wo.length);
    for (let k = 0; k < rgb.length; k++) rgb[k] = found[4 * Math.floor(k / 3) + (k % 3)];
    this.plane = { angles: angles.slice(1), rgb: rgb.slice(3, 3 * angles.length) };
    this.here = rgb.slice(0, 3);
    this.around = { ...around, rgb: rgb.slice(3 * angles.length) };
    this.old = false;
    this.scaled();
  }

  // Plot what was measured, as the settings say.
  scaled() {
    const { settings: { scale, cosine, channels }, light, view, plane, around } = this;
    const weighed = (rgb, cosines) => (cosine ? rgb.map((f, k) => f * cosines(Math.floor(k / 3))) : rgb);
    const values = weighed(plane.rgb, (k) => Math.cos(plane.angles[k]));
    this.peak = values.reduce((a, b) => Math.max(a, b), 0);
    this.polar.draw({ angles: plane.angles, values, peak: this.peak, scale: SCALES[scale], incidence: light.theta, view });
    this.picture.shape(around.directions, weighed(around.rgb, (k) => around.directions[3 * k + 2]), SCALES[scale], channels);
    this.list(values, weighed(this.here, () => Math.cos(view)));
    for (const [name, value] of Object.entries({ light: light.theta, azimuth: light.phi, view })) {
      const { input, output } = this.inputs[name];
      input.value = value / DEGREE;
      output.textContent = `${(value / DEGREE).toFixed(1)}°`;
    }
    this.turned = true;
  }

  list(values, here) {
    const peaks = [0, 1, 2].map((c) => values.filter((_, k) => k % 3 === c).reduce((a, b) => Math.max(a, b), 0));
    const rows = [["At the view", here], ["Highest", peaks], ["Reflected in all", this.around.albedo(this.around.rgb)]];
    const cell = (x) => made("td", {}, rounded(x, 3));
    const titles = CHANNELS.map((name, c) => made("th", { scope: "col", className: `channel-${c}` }, name));
    const head = made("tr", {}, made("td"), ...titles);
    const unit = this.settings.cosine ? "fᵣ cos θₒ in 1/sr" : "fᵣ in 1/sr";
    this.table.replaceChildren(made("caption", {}, `${unit}, and the fraction of light that is reflected in all`), head,
      ...rows.map(([title, numbers]) => made("tr", {}, made("th", { scope: "row" }, title), ...Array.from(numbers, cell))));
  }

  paint() {
    this.turned = false;
    const { light: { theta, phi }, view, page: { renderer } } = this;
    const toward = (angle) => spherical(angle, phi + Math.PI);
    const rays = { light: spherical(theta, phi), mirror: toward(theta), view: toward(view).map((x) => 1.08 * x) };
    const [x, y] = this.picture.paint(renderer.scene.turn, rays);
    this.handle.style.left = `${50 + 50 * x}%`;
    this.handle.style.top = `${50 - 50 * y}%`;
  }

  // Signs with which going right changes the azimuth and going down the polar angle.
  waysNow() {
    const { light: { theta, phi } } = this, near = 0.01;
    const at = (t, p) => this.picture.seen(this.page.renderer.scene.turn, spherical(t, p));
    const [right] = at(theta, phi + near).map((x, k) => x - at(theta, phi - near)[k]);
    const [, up] = at(theta + near, phi).map((x, k) => x - at(theta - near, phi)[k]);
    return [Math.sign(right) || 1, -Math.sign(up) || 1];
  }

  // A range of degrees with its number; `change` is called with radians.
  angle(name, title, min, max, change) {
    const label = range(title, [min, max, "any", 0], (degrees) => change(degrees * DEGREE)), output = made("output");
    const input = label.lastChild;
    input.setAttribute("aria-label", title);
    keyed(input, { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }, (step) =>
      attempt(() => change((Math.round(Number(input.value)) + step) * DEGREE)));
    this.inputs[name] = { input, output };
    label.append(output);
    return label;
  }
}
