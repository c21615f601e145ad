// The mode that shows encoded textures in the light of a lamp that moves.

import { attempt, button, choice, listed, made, pressed, range } from "./dom.js";
import { Mode, state } from "./look.js";
import { Textured } from "./textured.js";

const CONVERGED = 16; // frames: then edges are smooth
const PERIOD = 8; // seconds of a path of the lamp
const SHAPES = [["plane", "Plane"], ["cylinder", "Cylinder"], ["cloth", "Cloth"]];
// Where the lamp is seen at a part of the period, in radii of the shape.
const PATHS = {
  circle: (turn) => [0.6 * Math.sin(turn), 0.6 * Math.cos(turn)],
  sweep: (turn) => [0.85 * Math.sin(turn), 0.25],
};

export class Textures extends Mode {
  static available(page) {
    return page.facts.textures?.length > 0;
  }

  constructor(page) {
    super(page, "Textures", made("div", { className: "textures" }));
    const textured = new Textured(page.renderer, new TextDecoder().decode(page.bytes(page.facts.texture_glsl)));
    Object.assign(this, { path: "still", held: page.facts.textures, read: new Map(), textured });
    this.buttons = this.held.map(({ thumbnail, name }, k) => {
      const inside = [made("img", { src: page.shelf.packed(thumbnail), alt: "" }), made("span", {}, name)];
      return button(inside, () => this.choose(k), { className: "material", "aria-pressed": "false" });
    });
    const { view } = textured, change = (name) => (value) => {
      textured.change({ [name]: value });
      page.touched();
    };
    this.light = choice("Lamp", [["still", "Still"], ["circle", "Around"], ["sweep", "From side to side"]], (path) => this.follow(path));
    // What the address holds of this mode, by name: the inputs of Textured.view.
    this.inputs = {
      shape: choice("Surface", SHAPES, change("shape")),
      repeats: range("Repeats", [1, 16, 1, view.repeats], change("repeats")),
      tilt: range("Tilt (degrees)", [0, 80, 1, view.tilt], change("tilt")),
      zoom: range("Zoom", [1, 8, 0.1, view.zoom], change("zoom")),
      depth: range("Relief", [0, 2, 0.05, view.depth], change("depth")),
    };
    this.first = { ...view };
    this.known = made("dl");
    this.name = made("h2");
    const { shape, ...ranges } = this.inputs;
    this.panel.append(
      this.name,
      made("div", { className: "group", role: "group", "aria-label": "Textures" }, ...this.buttons),
      made("div", { className: "settings" }, shape, this.light, ...Object.values(ranges)),
      this.known,
    );
    // Moving the lamp by hand takes it off its path.
    for (const event of ["pointerdown", "keydown"]) page.controls.handle.addEventListener(event, (e) => {
      if (e.key === undefined || e.key.startsWith("Arrow")) this.follow("still");
    });
    this.usual = matchMedia("(prefers-reduced-motion: reduce)").matches ? "still" : "circle";
    this.follow(this.usual);
  }

  // Show a texture, once it is unpacked; resolves then.
  async choose(k) {
    const facts = this.held[k], { read, page } = this;
    pressed(this.buttons, k);
    this.name.textContent = facts.name;
    this.known.replaceChildren(...listed(facts.known));
    this.inputs.depth.hidden = !facts.relief;
    this.chosen = k;
    page.touched();
    if (!read.has(k)) read.set(k, this.textured.loaded(facts, page.bytes, (part) => (facts.part = part)));
    const texture = await read.get(k);
    if (this.chosen === k) this.textured.show(texture);
  }

  // Its part of the address: what is not as at first.
  state() {
    const { chosen, held, first, textured: { view }, path } = this, found = {};
    if (chosen) found.texture = `${chosen + 1}`;
    if (held[chosen]?.kind) found.kind = held[chosen].kind;
    for (const name of Object.keys(this.inputs)) if (view[name] !== first[name]) found[`texture-${name}`] = `${view[name]}`;
    if (path !== "still") found.at = undefined; // the lamp is anywhere
    return path === this.usual ? found : { ...found, "lamp-path": path };
  }

  restore(texts) {
    const found = {};
    for (const [name, { lastChild: input }] of Object.entries(this.inputs)) {
      const text = texts[`texture-${name}`];
      input.value = text ?? this.first[name];
      if (!input.value) input.value = this.first[name]; // a choice that there is not
      found[name] = input.type === "range" ? Number(input.value) : input.value;
    }
    this.textured.change(found);
    this.follow(Object.hasOwn(PATHS, texts["lamp-path"] ?? "") || texts["lamp-path"] === "still" ? texts["lamp-path"] : this.usual);
    const k = Number(texts.texture ?? 1) - 1;
    return this.choose(this.held[k] ? k : 0);
  }

  // The chosen texture is not unpacked yet.
  get waits() {
    return this.textured.texture?.facts !== this.held[this.chosen];
  }

  // Let the lamp move along a path, from where it would be by now.
  follow(path) {
    this.path = path;
    this.light.lastChild.value = path;
    this.times = [];
    this.page.touched();
  }

  open() {
    const { controls, renderer } = this.page;
    controls.shine(Number(controls.strength.value) || 1);
    if (this.chosen === undefined) attempt(() => this.choose(0));
    renderer.canvas.setAttribute("aria-label", "Texture; arrow keys turn it");
    this.times = [];
    this.textured.frames = 0;
  }

  close() {
    const { controls, renderer } = this.page;
    controls.shine(Number(controls.strength.value));
    super.close();
    renderer.restart();
  }

  lit(change) {
    if (Object.keys(change).some((name) => name !== "exposure")) this.textured.frames = 0;
  }

  draw() {
    const { textured, times, page } = this, now = performance.now() / 1000;
    if (this.waits) return `unpacking, ${Math.round(100 * (this.held[this.chosen].part ?? 0))} %`;
    if (this.path !== "still") page.controls.move(...PATHS[this.path]((2 * Math.PI * (now % PERIOD)) / PERIOD));
    const moving = textured.frames === 0;
    if (textured.frames < CONVERGED) textured.frame();
    page.renderer.present(textured.latest, textured.frames);
    while (times.length && times[0] < now - 1) times.shift();
    if (moving) times.push(now);
    if (this.path !== "still") return times.length > 1 ? rate(Math.round((times.length - 1) / (times.at(-1) - times[0]))) : "";
    return state(textured.frames, CONVERGED);
  }
}

const rate = (count) => `${count} ${count === 1 ? "picture" : "pictures"} a second`;
