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
    this.light = choice("Lamp", [["still", "Still"], ["circle", "Around"], ["sweep", "From side to side"]], (path) => this.follow(path));
    this.depth = range("Relief", [0, 2, 0.05, 1], (depth) => textured.change({ depth }));
    this.known = made("dl");
    this.name = made("h2");
    this.panel.append(
      this.name,
      made("div", { className: "group", role: "group", "aria-label": "Textures" }, ...this.buttons),
      made("div", { className: "settings" },
        choice("Surface", SHAPES, (shape) => textured.change({ shape })),
        this.light,
        range("Repeats", [1, 16, 1, 1], (repeats) => textured.change({ repeats })),
        range("Tilt (degrees)", [0, 80, 1, 30], (tilt) => textured.change({ tilt })),
        range("Zoom", [1, 8, 0.1, 1.3], (zoom) => textured.change({ zoom })),
        this.depth),
      this.known,
    );
    // Moving the lamp by hand takes it off its path.
    for (const event of ["pointerdown", "keydown"]) page.controls.handle.addEventListener(event, (e) => {
      if (e.key === undefined || e.key.startsWith("Arrow")) this.follow("still");
    });
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.follow("circle");
  }

  // Show a texture, once it is unpacked; resolves then.
  async choose(k) {
    const facts = this.held[k], { read, page } = this;
    pressed(this.buttons, k);
    this.name.textContent = facts.name;
    this.known.replaceChildren(...listed(facts.known));
    this.depth.hidden = !facts.relief;
    this.chosen = k;
    if (!read.has(k)) read.set(k, this.textured.loaded(facts, page.bytes, (part) => (facts.part = part)));
    const texture = await read.get(k);
    if (this.chosen === k) this.textured.show(texture);
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
    if (this.path !== "still") return times.length > 1 ? `${Math.round((times.length - 1) / (times.at(-1) - times[0]))} pictures a second` : "";
    return state(textured.frames, CONVERGED);
  }
}
