// A material in a picture of its own, for other people's pages and notebooks.
//
// One renderer draws all pictures of a document, since browsers keep few WebGL contexts. Each frame
// goes to the picture that was turned last, then to those that are empty or out of date, then to the
// one that is being refined.

import { made } from "./dom.js";
import { Renderer } from "./renderer.js";
import { initial, SETTINGS } from "./settings.js";
import { Turning, dragged } from "./turning.js";

const FIRST = 7; // pairs of directions until another picture gets its first ones
const CONVERGED = 127;
const AREA = 256 ** 2; // pixels up to which a frame may draw more pairs
const LARGEST = 1024; // pixels along an edge
const LAMP = "lamp"; // the light that is a lamp alone

// What `set` changes, by the names of attributes: as in addresses of the page (see settings.js).
export const VIEWED = ["shape", "light", "exposure", "rotation", "turn", "curve", "stage"];

// Here a picture is a sphere on nothing, unless told otherwise.
const UNLESS_TOLD = { ...initial(), shape: "sphere", stage: "off", curve: "plain" };

const STYLE = `
:host { display: inline-block; position: relative; box-sizing: border-box; width: 256px; max-width: 100%; aspect-ratio: 1; overflow: hidden; }
:host([hidden]) { display: none; }
canvas { display: block; width: 100%; height: 100%; object-fit: contain; touch-action: pan-y; cursor: grab; border-radius: 50%; }
canvas.staged { border-radius: 8px; }
canvas:active { cursor: grabbing; }
canvas:focus-visible { outline: 2px solid currentColor; outline-offset: -2px; }
p { position: absolute; inset: auto 0 0 0; margin: 0; padding: 6px 8px; font: 13px/1.4 system-ui, sans-serif; overflow-wrap: anywhere; background: Canvas; color: CanvasText; border: 1px solid GrayText; border-radius: 6px; }
p[hidden] { display: none; }`;

class Studio {
  views = new Set();
  running = false;

  add(view) {
    this.views.add(view);
    this.wake();
  }

  remove(view) {
    this.views.delete(view);
    if (this.current === view) this.current = null;
  }

  wake() {
    if (this.running) return;
    this.running = true;
    requestAnimationFrame(() => this.step());
  }

  next() {
    const open = [...this.views].filter((view) => view.read && view.seen && (view.stale || view.drawn < CONVERGED));
    return open.find((view) => view === this.held) ?? open.find((view) => view.stale || view.drawn < FIRST)
      ?? open.find((view) => view === this.current) ?? open[0];
  }

  step() {
    const view = this.next();
    this.running = Boolean(view);
    if (!view) return;
    try {
      this.renderer ??= this.opened();
      if (this.renderer.done()) this.draw(view);
    } catch (error) {
      view.show(null);
      view.say("picture", error.message);
    }
    requestAnimationFrame(() => this.step());
  }

  opened() {
    const canvas = made("canvas", { width: 1, height: 1 });
    canvas.addEventListener("webglcontextlost", () => {
      this.renderer = null;
      for (const view of this.views) view.touch({});
    });
    this.current = this.light = this.material = null;
    return new Renderer(canvas);
  }

  draw(view) {
    const { renderer } = this, other = this.current !== view;
    if (renderer.size.some((length) => length !== view.size)) renderer.resize(view.size, view.size);
    if (this.light !== view.lit) renderer.light((this.light = view.lit), view.bytes);
    const material = view.material(renderer);
    if (other || this.material !== material) renderer.show((this.material = material));
    renderer.change(other ? view.scene : view.changes);
    view.changes = {};
    this.current = view;
    renderer.pairs = Math.min(Math.max(Math.round((2 * AREA) / view.size ** 2), 2), 8);
    if (renderer.drawn < CONVERGED) renderer.frame();
    // A picture that was started again replaces the old one once it is no noisier.
    if (view.stale || renderer.drawn >= view.drawn) {
      renderer.present();
      view.paint(renderer.canvas, renderer.drawn);
    }
    renderer.mark();
  }
}

const studio = new Studio();

export class View {
  // A picture in the shadow of an element, with the environments of a page's `facts` and `bytes`.
  constructor(host, { facts, bytes }) {
    Object.assign(this, { host, bytes, environments: facts.environments, troubles: {} });
    const turning = (this.turning = new Turning());
    this.scene = { shape: "sphere", stage: false, film: false, turn: turning.by(0, 0), rotation: 0, exposure: 1, backing: 0, surroundings: 1, irradiance: [0, 0, 0] };
    Object.assign(this, { read: null, stale: true, drawn: 0, seen: true, size: 256, changes: {}, words: ["", ""] });
    const root = host.shadowRoot ?? host.attachShadow({ mode: "open" });
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(STYLE);
    root.adoptedStyleSheets = [sheet];
    this.canvas = made("canvas", { width: this.size, height: this.size, tabIndex: 0, role: "img" });
    this.trouble = made("p", { role: "alert", hidden: true });
    root.replaceChildren(this.canvas, this.trouble);
    dragged(this.canvas, (across, down) => {
      studio.held = this;
      this.touch({ turn: turning.by(across, down) });
    });
    this.sizes = new ResizeObserver(() => this.measure());
    this.sights = new IntersectionObserver((found) => {
      this.seen = found.at(-1).isIntersecting;
      studio.wake();
    });
    this.set("light", "");
  }

  start() {
    this.sizes.observe(this.host);
    this.sights.observe(this.host);
    this.measure();
    studio.add(this);
  }

  stop() {
    this.sizes.disconnect();
    this.sights.disconnect();
    studio.remove(this);
  }

  measure() {
    const { width, height } = this.host.getBoundingClientRect();
    const size = Math.min(Math.round(Math.min(width, height) * (window.devicePixelRatio || 1)), LARGEST);
    if (size < 1 || size === this.size) return;
    this.size = size;
    this.touch({});
  }

  // Set one of `VIEWED` from text; what is unknown is reported, and the old one stays.
  set(name, text) {
    this.say(name, "");
    try {
      const { parse, scene } = SETTINGS[name], value = text.trim() ? parse(text.trim()) : UNLESS_TOLD[name];
      this.touch(scene ? scene(value) : this[name](value));
    } catch (error) {
      this.say(name, error.message);
    }
    this.label();
  }

  turn([across, up]) {
    return { turn: this.turning.to(across, up) };
  }

  curve(curve) {
    return { film: curve === "film" };
  }

  stage(stage) {
    this.canvas.classList.toggle("staged", stage === "on");
    return { stage: stage === "on" };
  }

  light(text) {
    const names = [...this.environments.map((each) => each.name), LAMP], name = text || names[0];
    const found = this.environments.find((each) => each.name === name);
    if (!found && name !== LAMP) throw new Error(`light "${name}" is none of ${names.join(", ")}`);
    this.lit = found ?? this.environments[0];
    this.words[1] = name;
    return found ? { surroundings: 1, irradiance: [0, 0, 0] } : { surroundings: 0, irradiance: [Math.PI, Math.PI, Math.PI] };
  }

  // Show the material that a function of a renderer returns, under a name; nothing if it is null.
  show(read, name = "") {
    Object.assign(this, { read, context: null });
    this.words[0] = name;
    this.label();
    if (!read) this.canvas.getContext("2d").clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.touch({});
  }

  material(renderer) {
    if (this.context !== renderer) this.made = this.read(renderer);
    this.context = renderer;
    return this.made;
  }

  label(text = this.alt) {
    this.alt = text;
    const [name, light] = this.words, { shape } = this.scene;
    this.canvas.setAttribute("aria-label", text || (name ? `${name}, ${shape}, light ${light}` : "No material"));
  }

  // Report what fails, by name; "" once it no longer does.
  say(name, text) {
    this.troubles[name] = text;
    this.trouble.textContent = Object.values(this.troubles).filter(Boolean).join("; ");
    this.trouble.hidden = !this.trouble.textContent;
    if (text) this.host.dispatchEvent(new CustomEvent("error", { detail: text }));
  }

  touch(change) {
    Object.assign(this.scene, change);
    Object.assign(this.changes, change);
    this.stale = true;
    studio.wake();
  }

  paint(canvas, drawn) {
    if (this.canvas.width !== canvas.width) Object.assign(this.canvas, { width: canvas.width, height: canvas.height });
    const flat = this.canvas.getContext("2d");
    flat.clearRect(0, 0, canvas.width, canvas.height);
    flat.drawImage(canvas, 0, 0);
    if (this.drawn < CONVERGED && drawn >= CONVERGED) this.host.dispatchEvent(new CustomEvent("load"));
    Object.assign(this, { drawn, stale: false });
  }
}
