// The mode that compares two materials: in pictures, and in the numbers of nacre compare.

import { fit, RAMP, view, VIEWS } from "./compare_view.js";
import { attempt, button, choice, element, keyed, made, pressed, range } from "./dom.js";
import { pictureErrors } from "./errors.js";
import { Flip } from "./flip.js";
import { LAST, Mode, state } from "./look.js";
import { Protocol } from "./protocol.js";
import { dragged } from "./turning.js";

const MEASURES = [["ssim", "SSIM"], ["psnr", "PSNR (dB)"], ["mae", "MAE"], ["rmse", "RMSE"], ["flip", "FLIP"]];
const ANGLES = [
  ["log_cosine", "Log-cosine error"], ["log_cosine_p95", "its 95th percentile"],
  ["relative_median", "Relative error, median"], ["rmse_cosine", "RMSE of f cos (1/sr)"],
];
const NOTE = "Here: this picture as far as it is. nacre compare: its sphere under its directional light, 128 pixels wide.";
const KEYS = { PageDown: -0.1, PageUp: 0.1, Home: -1, End: 1 }; // parts of the width; see also turning.js
const PAUSE = 200; // ms after a change of the scene, as numbers take a while

export class Compare extends Mode {
  constructor(page) {
    super(page, "Compare");
    Object.assign(this, { view: "Wipe", wipe: 0.5, factor: 4, protocol: new Protocol(page.renderer) });
    this.truth = choice("Reference", [], (value) => page.choose(this.pairs[value].k, this.pairs[value].f));
    this.other = choice("Other", [], (k) => this.against(this.pairs[k]));
    const swap = button("\u21c5", () => this.swap(), { title: "Swap", "aria-label": "Swap" });
    this.buttons = Object.keys(VIEWS).map((name) => button(name, () => this.turnTo(name)));
    const views = made("div", { className: "buttons", role: "group", "aria-label": "View" }, ...this.buttons);
    this.strength = range("Difference", [0, 5, 1, 2], (x) => this.times(2 ** x));
    this.strength.append(made("output"));
    const legend = { className: "scale", role: "img", "aria-label": "FLIP error by color, from 0 to 1" };
    this.scale = made("div", legend, made("span", {}, "0"), made("i"), made("span", {}, "1"));
    this.scale.children[1].style.background = RAMP;
    this.numbers = made("div", { className: "numbers" });
    this.panel = made("div", { className: "compare" },
      made("div", { className: "pair" }, this.truth, this.other, swap), views, this.strength, this.scale, this.numbers);
    this.overlay();
    this.times(this.factor);
  }

  // On the picture: the handle of the wipe, and what is where.
  overlay() {
    const slider = { role: "slider", "aria-label": "Wipe between the two pictures", "aria-valuemin": 0, "aria-valuemax": 100 };
    this.handle = made("div", { id: "wipe", tabIndex: 0, ...slider });
    this.captions = made("div", { id: "captions" }, ...Object.keys(VIEWS).map(() => made("span")));
    dragged(this.handle, (across) => this.slide(this.wipe + across / element("frame").clientWidth));
    keyed(this.handle, KEYS, (part) => this.slide(this.wipe + part));
    element("frame").append(this.handle, this.captions);
    for (const each of [this.handle, this.captions]) each.hidden = true;
    this.slide(this.wipe);
  }

  // The part of the address: the view, where the wipe is, and what the reference is compared with.
  state() {
    const { page, held, view, wipe } = this, found = {};
    if (view !== "Wipe") found.view = view.toLowerCase();
    if (wipe !== 0.5) found.split = `${Number((100 * wipe).toFixed(2))}`;
    return held ? { ...found, with: page.materials.title(held.material), as: held.form.label } : found;
  }

  restore({ view, split, with: title, as: label }) {
    this.turnTo(Object.keys(VIEWS).find((name) => name.toLowerCase() === view) ?? "Wipe");
    this.slide(Number.isFinite(Number(split ?? 50)) ? Number(split ?? 50) / 100 : 0.5);
    const pair = this.pairs.find(({ material, form }) => this.page.materials.title(material) === title && form.label === label);
    if (pair) this.against(pair);
  }

  open() {
    this.captions.hidden = false;
    this.turnTo(this.view);
    this.changed();
  }

  close() {
    const { renderer } = this.page;
    this.handle.hidden = this.captions.hidden = true;
    this.flip?.free();
    this.flip = null;
    fit(renderer.canvas, renderer.size);
    delete document.body.dataset.view;
    super.close();
  }

  // All forms of all materials, by number: [material, form].
  list() {
    const { list } = this.page.materials;
    this.pairs = list.flatMap((material, k) => material.forms.map((form, f) => ({ k, f, form, material })));
    const options = () => this.pairs.map((pair, value) => made("option", { value, textContent: this.named(pair) }));
    for (const each of [this.truth, this.other]) each.lastChild.replaceChildren(...options());
  }

  named({ material, form }) {
    return material.forms.length > 1 ? `${material.name}, ${form.label}` : material.name;
  }

  at(form) {
    return this.pairs.findIndex((pair) => pair.form === form);
  }

  // The page shows another material or form. What it is compared with stays, unless that was another
  // form of the material before, or is this one.
  changed() {
    const { page } = this, { form, chosen } = page;
    if (this.pairs?.length !== page.materials.list.flatMap(({ forms }) => forms).length) this.list();
    const { reference: before, held } = this, within = held && held.material === before.material && held.material !== chosen;
    this.reference = this.pairs[this.at(form)];
    if (held && held.form !== form && !within) this.show();
    else this.against(this.partner(within ? held : undefined, before));
  }

  // What to compare the reference with first: another form of it, like the one before; otherwise the
  // reference before, or the next material on the shelf.
  partner(like, before) {
    const { reference, pairs } = this;
    const others = pairs.filter(({ material, form }) => material === reference.material && form !== reference.form);
    return others.find(({ form }) => form.label === like?.form.label) ?? others[0] ??
      (before && before !== reference ? before : pairs[(this.at(reference.form) + 1) % pairs.length]);
  }

  against(pair) {
    attempt(() => this.show(pair));
    this.other.lastChild.value = `${this.at(this.held.form)}`;
    this.page.touched();
  }

  swap() {
    const { reference, held } = this;
    Object.assign(this, { reference: held, held: reference });
    this.page.choose(held.k, held.f);
  }

  show(held = this.held) {
    const { page, reference } = this, materials = [reference, held].map(({ form }) => page.materials.shown(form));
    page.renderer.show(...materials);
    Object.assign(this, { held, materials, measured: {} });
    [[this.truth, reference], [this.other, held]].forEach(([each, { form }]) => (each.lastChild.value = `${this.at(form)}`));
    this.said();
    this.caption();
  }

  turnTo(name) {
    this.view = name;
    this.stale = true;
    pressed(this.buttons, Object.keys(VIEWS).indexOf(name));
    const side = name === "Side by side";
    this.handle.hidden = name !== "Wipe";
    this.strength.hidden = !(side || name === "Difference");
    this.scale.hidden = !(side || name === "FLIP");
    document.body.dataset.view = name.split(" ")[0].toLowerCase();
    this.page.touched();
  }

  slide(part) {
    this.wipe = Math.min(Math.max(part, 0), 1);
    this.stale = true;
    this.handle.style.left = `${100 * this.wipe}%`;
    this.handle.setAttribute("aria-valuenow", `${Math.round(100 * this.wipe)}`);
    this.page.touched();
  }

  times(factor) {
    this.factor = factor;
    this.stale = true;
    this.strength.lastChild.textContent = `× ${factor}`;
    this.caption();
  }

  caption() {
    if (!this.held) return;
    const words = [this.named(this.reference), this.named(this.held), `Difference × ${this.factor}`, "FLIP"];
    [...this.captions.children].forEach((each, k) => (each.textContent = words[k]));
    element("picture").setAttribute("aria-label", `${words[0]} beside ${words[1]}; arrow keys turn them`);
  }

  // The scene has changed: its numbers no longer hold.
  lit() {
    const { protocol, here } = this.measured;
    this.measured = { protocol, since: performance.now() };
    this.stale = true;
    if (here) this.said();
  }

  // One more frame if it helps; maps and numbers whenever there are four times as many frames.
  draw() {
    const { renderer } = this.page, { size, scene } = renderer;
    if (`${this.flip?.size}` !== `${size}`) {
      this.flip?.free();
      this.flip = new Flip(renderer, size);
      this.lit();
    }
    this.count();
    if (renderer.frames < LAST) {
      renderer.frame();
      this.stale = true;
    }
    const { measured } = this, due = 4 ** Math.floor(Math.log2(renderer.frames) / 2);
    const counted = due > 1 && measured.counted !== due && !(performance.now() - measured.since < PAUSE);
    const mapped = (this.view === "FLIP" || this.view === "Side by side") && measured.mapped !== due;
    const pair = renderer.pictures.map(({ latest }) => latest.textures[0]);
    if (counted || mapped) {
      this.flip.update(pair, scene.exposure, renderer.drawn);
      measured.mapped = due;
    }
    if (counted) Object.assign(measured, { counted: due, drawn: true });
    if (this.stale || mapped) {
      const { view: name, wipe, factor } = this;
      view(renderer, pair, this.flip.map.textures[0], { view: VIEWS[name], wipe, factor });
    }
    this.stale = false;
    return state(renderer.frames);
  }

  // Find some of the numbers for what is drawn so far; the page waits for them.
  count() {
    const { measured, flip } = this;
    if (measured.drawn) {
      const { toned, map } = flip.read();
      Object.assign(measured, { drawn: false, here: pictureErrors(toned, map, flip.size) });
    } else if (measured.here && !measured.protocol) measured.protocol = this.protocol.errors(...this.materials);
    else return;
    this.said();
  }

  said() {
    const { here, protocol } = this.measured;
    const row = (label, ...values) =>
      made("tr", {}, made("th", { scope: "row" }, label), ...values.map((value) => made("td", {}, said(value))));
    const head = (...words) => made("tr", {}, ...words.map((word) => made("th", { scope: "col" }, word)));
    const table = (caption, ...rows) => made("table", {}, made("caption", {}, caption), ...rows);
    const pairs = protocol ? `${protocol.angles.count.toLocaleString("en")} ` : "";
    this.numbers.replaceChildren(
      table("Errors after a gamma of 2.2", head("Measure", "Here", "nacre compare"),
        ...MEASURES.map(([key, label]) => row(label, here?.[key], protocol?.sphere[key]))),
      table(`Over ${pairs}pairs of directions`, ...ANGLES.map(([key, label]) => row(label, protocol?.angles[key]))),
      made("p", { className: "quiet" }, NOTE),
    );
  }
}

function said(value) {
  if (value === undefined) return "…";
  if (!Number.isFinite(value)) return "∞";
  return value === 0 || (value > 1e-4 && value < 1e4) ? value.toPrecision(4) : value.toExponential(3);
}
