// Shape, light and exposure; turning the shape and moving the lamp on the picture.

import { attempt, choice, element, made, range } from "./dom.js";
import { initial, SETTINGS } from "./settings.js";
import { middle } from "./stage.js";
import { Turning, dragged } from "./turning.js";

const DISTANCE = 2.5; // of the lamp, in radii of the shape
const LAMP_ALONE = "lamp";
const STOPS = 4; // exposures that the slider reaches

const capital = (text) => text[0].toUpperCase() + text.slice(1);
const signed = (x) => `${x > 0 ? "+" : x < 0 ? "\u2212" : ""}${Math.abs(x).toFixed(1)}`;
const SETTERS = { stage: "restaged", curve: "restaged", lamp: "shine", at: "put" }; // others are named as what they set
const SAID = {
  rotation: (x) => `${x}°`,
  exposure: (x) => `${signed(x)} stops`,
  lamp: (x) => (x ? `× ${x}` : "off"),
};

export class Controls {
  constructor(page) {
    const lights = page.facts.environments.map((each) => [each.name, each.name]);
    const words = (name) => SETTINGS[name].words.map((word) => [word, capital(word)]);
    Object.assign(this, { page, view: new Turning(), spot: { x: -0.5, y: 0.5 }, said: {} });
    this.first = { ...initial(), light: lights[0][0] };
    this.values = { ...this.first };
    const ranges = { rotation: [-180, 180, 1, 0], exposure: [-STOPS, STOPS, 0.1, 0], lamp: [0, 4, 0.1, 0] };
    const changed = (name) => (value) => this.set(name, value);
    this.fields = {
      shape: choice("Shape", words("shape"), changed("shape")),
      stage: choice("Stage", words("stage"), changed("stage")),
      light: choice("Light", [...lights, [LAMP_ALONE, "Lamp alone"]], changed("light")),
      rotation: range("Rotation", ranges.rotation, changed("rotation")),
      exposure: range("Exposure", ranges.exposure, changed("exposure")),
      curve: choice("Tones", [["film", "Film"], ["plain", "Plain sRGB"]], changed("curve")),
      lamp: range("Lamp", ranges.lamp, changed("lamp")),
    };
    for (const [name, field] of Object.entries(this.fields)) {
      field.dataset.control = name;
      if (SAID[name]) field.append((this.said[name] = made("output")));
    }
    element("controls").append(...Object.values(this.fields));
    this.strength = this.fields.lamp.querySelector("input");
    this.handle = made("button", { id: "lamp", type: "button", title: "Lamp: drag it, or move it with the arrow keys", "aria-label": "Lamp", hidden: true });
    element("frame").append(this.handle);
    this.dragged(element("picture"), (across, down) => {
      this.view.by(across, down);
      this.set("turn", this.view.degrees());
    });
    this.dragged(this.handle, (across, down) => {
      const radius = this.radius();
      this.set("at", [this.spot.x + across / radius, this.spot.y - down / radius]);
    });
    this.all({});
  }

  // The same as `dragged` in turning.js, with errors shown.
  dragged(target, change) {
    dragged(target, (across, down) => attempt(() => change(across, down)));
  }

  // Set everything: what is not given is as at first.
  all(values) {
    const known = this.page.facts.environments.some(({ name }) => name === values.light) || values.light === LAMP_ALONE;
    const whole = { ...this.first, ...values, light: known ? values.light : this.first.light };
    for (const [name, value] of Object.entries(whole)) if (`${this.values[name]}` !== `${value}` || !this.ready) this.set(name, value);
    this.ready = true;
  }

  // Values are as exact as an address, so that it shows the same.
  set(name, wanted) {
    const { parse, text, scene } = SETTINGS[name], value = parse(text(wanted));
    this.values[name] = value;
    const field = this.fields[name]?.querySelector("input, select");
    if (field) field.value = value;
    if (this.said[name]) this.said[name].textContent = SAID[name](value);
    if (scene) this.page.scene(scene(value));
    else this[SETTERS[name] ?? name](value);
    this.page.touched?.();
  }

  restaged() {
    this.staged(this.page.mode?.staged);
  }

  // Whether the mode has a stage and a choice of tones.
  staged(has = false) {
    const { stage, curve } = this.values;
    this.page.renderer.change({ stage: has && stage === "on", film: has && curve === "film" });
    this.framed();
  }

  turn([across, up]) {
    this.page.scene({ turn: this.view.to(across, up) });
    this.framed();
  }

  // The next of the values of a choice.
  next(name) {
    const options = [...this.fields[name].querySelector("select").options], at = options.findIndex(({ value }) => value === this.values[name]);
    this.set(name, options[(at + 1) % options.length].value);
  }

  brighten(stops) {
    this.set("exposure", this.values.exposure + stops);
  }

  // By name; tests name it by number.
  light(name) {
    const { environments } = this.page.facts, found = environments.find((each, k) => each.name === name || k === name);
    if (found) this.page.renderer.light(found, this.page.bytes);
    else if (this.values.lamp === 0) this.set("lamp", 1);
    this.page.scene({ surroundings: found ? 1 : 0 });
  }

  // A white surface at the middle of the shape that faces the lamp has the radiance `strength`.
  shine(strength) {
    this.handle.hidden = strength === 0;
    this.page.scene({ irradiance: Array(3).fill(Math.PI * strength * DISTANCE ** 2) });
  }

  put([x, y]) {
    this.move(x, y);
  }

  // Put the lamp before the shape, where its direction is seen at x and y.
  move(x, y) {
    const length = Math.max(Math.hypot(x, y) / 0.98, 1);
    const at = SETTINGS.at.parse(SETTINGS.at.text([x / length, y / length]));
    this.values.at = at;
    this.spot = { x: at[0], y: at[1] };
    const z = Math.sqrt(Math.max(1 - at[0] ** 2 - at[1] ** 2, 0));
    this.page.scene({ lamp: [...at, z].map((a) => a * DISTANCE).concat(1) });
    at.forEach((place, k) => this.handle.style.setProperty(["--x", "--y"][k], `${place}`));
  }

  // CSS pixels of a unit of the shape.
  radius() {
    const { canvas, size, scene } = this.page.renderer;
    if (scene.stage) return (canvas.clientHeight / 2) * middle(scene.turn, size).radius;
    return (canvas.clientWidth / 2) * (size[0] / canvas.width);
  }

  // Tell the style where the shape is in the picture, for the lamp's handle.
  framed() {
    const { style } = element("frame"), { scene, size: [width, height] } = this.page.renderer;
    const { y, radius } = scene.stage ? middle(scene.turn, [width, height]) : { y: 0, radius: 0.97 * Math.min(1, width / height) };
    style.setProperty("--middle", `${50 - 50 * y}%`);
    style.setProperty("--across", `${(50 * radius * height) / width}%`);
    style.setProperty("--up", `${50 * radius}%`);
  }
}
