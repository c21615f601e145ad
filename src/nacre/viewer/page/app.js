// The page: what it holds, what is chosen, and the mode that shows it.

import { Address, sceneOf, textsOf } from "./address.js";
import { Code } from "./code.js";
import { Compare } from "./compare.js";
import { Controls } from "./controls.js";
import { attempt, attributes, button, element, keyed, listed, made, pressed } from "./dom.js";
import { Drop } from "./drop.js";
import { Fitting } from "./fitting.js";
import { Lobes } from "./lobes.js";
import { Keys } from "./keys.js";
import { Kinds } from "./kinds.js";
import { Look } from "./look.js";
import { Materials } from "./materials.js";
import { Renderer } from "./renderer.js";
import { Sharing } from "./sharing.js";
import { Shelf, kindOf } from "./shelf.js";
import { Space } from "./space.js";
import { Textures } from "./textures.js";
import { Theme } from "./theme.js";

// In the order of their tabs.
//
// A mode has a title, a panel (an element beside the picture), a static available(page) (whether the page
// holds something for it), open(), close(), changed() (another material or form is chosen), draw() (what
// is new, on the picture; returns a word on its state), and, if it wants, lit(change) (the scene changed),
// staged (whether the scene may have a stage), state() and restore(texts) (its part of the address).
const MODES = [Look, Compare, Lobes, Space, Textures];

const KINDS = { measured: "Measured table", neural: "Neural network", analytic: "Analytic model", standard: "Standard model" };

const next = (list, one) => list[(list.indexOf(one) + 1) % list.length];

export class Page {
  constructor({ facts, bytes }) {
    this.renderer = new Renderer(element("picture"));
    Object.assign(this, { facts, bytes, materials: new Materials(facts, bytes, this.renderer) });
    this.controls = new Controls(this);
    this.shelf = new Shelf(this, (k) => attempt(() => this.choose(k)));
    this.drop = new Drop(this);
    this.fitting = new Fitting(this);
    this.code = new Code(this);
    this.kinds = new Kinds(this);
    this.sharing = new Sharing(this);
    this.start();
    this.address = new Address(() => this.state(), (texts) => attempt(() => this.restore(texts)));
    this.offer();
    this.loop();
  }

  // What the page does beside showing: buttons, and keys for all of it.
  offer() {
    const { sharing, address } = this, theme = new Theme();
    const undo = () => sharing.tell(address.undo() ? "Undone" : "Nothing to undo");
    const keys = new Keys([
      ["123456789", "The first materials", (key) => this.materials.list[key - 1] && this.choose(key - 1), "1 \u2026 9"],
      [["ArrowLeft", "ArrowRight"], "The material before or after", (key) => this.shelf.step(key === "ArrowLeft" ? -1 : 1), "\u2190 \u2192"],
      ["m", "The next mode", () => this.open(next(this.modes, this.mode)), "m"],
      ["s", "The next shape", () => this.controls.next("shape"), "s"],
      ["l", "The next light", () => this.controls.next("light"), "l"],
      ["eE", "Brighter, darker by a third of a stop", (key) => this.controls.brighten(key === "e" ? 1 / 3 : -1 / 3), "e E"],
      ["z", "Undo the last change", undo, "z"],
      ["c", "Copy a link to this view", () => sharing.copy(), "c"],
      ["p", "Save the picture (PNG)", () => sharing.png(), "p"],
      ["x", "Save its light (EXR)", () => sharing.exr(), "x"],
      ["t", "Dark or light page", () => theme.turn(), "t"],
      ["?", "This list", () => keys.show(), "?"],
    ], () => address.settle());
    element("actions").append(
      sharing.said, button("Copy link", () => sharing.copy()), button("Save picture", () => sharing.png(), { title: "PNG with its caption" }),
      button("Save EXR", () => sharing.exr(), { title: "Linear light, before exposure and tones" }), button("Undo", undo));
    element("page-actions").append(theme.button, button("Keys", () => keys.show(), { title: "All keys (?)" }));
  }

  // Its part of the address, as texts by name: what is not as at first.
  state() {
    const { chosen, form, mode, controls, materials } = this, found = {};
    if (mode !== this.modes[0]) found.mode = mode.title.toLowerCase();
    if (chosen && (chosen !== materials.list[0] || form !== chosen.forms[0])) found.material = materials.title(chosen);
    if (chosen?.kind) found.kind = chosen.kind;
    if (form && form !== chosen.forms[0]) found.form = form.label;
    const all = { ...found, ...textsOf(controls.values, controls.first), ...mode.state?.() };
    return Object.fromEntries(Object.entries(all).filter(([, text]) => text !== undefined));
  }

  // Show what an address says; what it does not say is as at first.
  async restore(texts) {
    if (this.kinds.has(texts.kind)) await this.kinds.load(texts.kind);
    const { materials } = this, mode = this.modes.find(({ title }) => title.toLowerCase() === texts.mode) ?? this.modes[0];
    const found = materials.list.findIndex((each) => materials.title(each) === texts.material), k = Math.max(found, 0);
    const form = materials.list[k]?.forms.findIndex(({ label }) => label === texts.form) ?? 0, shown = materials.list[k]?.forms[Math.max(form, 0)];
    this.controls.all(sceneOf(texts));
    if (shown && shown !== this.form) this.choose(k, Math.max(form, 0));
    this.open(mode);
    mode.restore?.(texts);
  }

  // Something of the state may have changed.
  touched() {
    this.address?.later();
  }

  // Offer the modes that have something to show.
  start() {
    const [first] = this.materials.list;
    Object.assign(this, { chosen: first, form: first?.forms[0] });
    this.modes = MODES.filter((Mode) => Mode.available(this)).map((Mode) => new Mode(this));
    const { notice, welcome, links = {} } = this.facts;
    element("notice").hidden = !notice;
    element("notice").lastElementChild.textContent = notice ?? "";
    element("welcome").hidden = !welcome;
    element("welcome").textContent = welcome ?? "";
    element("links").hidden = !Object.keys(links).length;
    element("links").replaceChildren(...Object.entries(links).map(([text, href]) => made("a", { href }, text)));
    this.tabs();
    if (first) this.choose(0);
  }

  // Take in the content of another file of the page, materials of a kind.
  join({ facts, bytes }, kind) {
    const own = this.bytes;
    this.bytes = this.materials.bytes = (name) => (Object.hasOwn(facts.parts, name) ? bytes(name) : own(name));
    for (const each of this.materials.join(facts)) {
      this.materials.list.push({ ...each, kind });
      this.shelf.add(each);
    }
    if (!facts.textures) return;
    (this.facts.textures ??= []).push(...facts.textures.map((each) => ({ ...each, kind })));
    this.facts.texture_glsl = facts.texture_glsl;
    const kept = this.modes.filter((mode) => !(mode instanceof Textures));
    this.modes = MODES.filter((Mode) => Mode.available(this)).map((Mode) => kept.find((mode) => mode.constructor === Mode) ?? new Mode(this));
    const open = this.mode;
    this.tabs();
    this.open(this.modes.includes(open) ? open : this.modes[0]);
  }

  openTexture(k) {
    const mode = this.modes.find((each) => each instanceof Textures);
    this.open(mode);
    return mode.choose(k);
  }

  tabs() {
    const list = element("modes");
    list.hidden = this.modes.length < 2;
    for (const each of [list, element("panels")]) each.replaceChildren();
    this.modes.forEach((mode, k) => {
      const name = mode.title.toLowerCase();
      const facts = { role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}` };
      mode.tab = button(mode.title, () => this.open(mode), facts);
      list.append(mode.tab);
      attributes(mode.panel, { id: `panel-${name}`, role: "tabpanel", "aria-labelledby": mode.tab.id });
      element("panels").append(mode.panel);
      keyed(mode.tab, { ArrowRight: 1, ArrowLeft: -1 }, (step) => {
        const next = this.modes[(k + step + this.modes.length) % this.modes.length];
        next.tab.focus();
        attempt(() => this.open(next));
      });
    });
    this.open(this.modes[0]);
  }

  open(mode) {
    if (this.mode === mode) return;
    this.mode?.close();
    this.mode = mode;
    for (const each of this.modes) {
      each.panel.hidden = each !== mode;
      each.tab.setAttribute("aria-selected", `${each === mode}`);
      each.tab.tabIndex = each === mode ? 0 : -1;
    }
    document.body.dataset.mode = mode.title.toLowerCase();
    this.controls.staged(mode.staged);
    mode.open();
    this.touched();
  }

  // Show a material on the shelf in one of its forms.
  choose(k, form = 0) {
    const chosen = this.materials.list[k];
    this.materials.shown(chosen.forms[form]);
    Object.assign(this, { chosen, form: chosen.forms[form] });
    this.shelf.select(k);
    this.describe();
    this.mode.changed();
    this.touched();
  }

  add(material) {
    this.materials.list.push(material);
    this.shelf.add(material);
    if (!this.chosen) this.start();
    else this.choose(this.materials.list.length - 1);
  }

  describe() {
    const { chosen, form } = this;
    element("name").textContent = chosen.name;
    const buttons = chosen.forms.map(({ label }, k) => button(label, () => this.choose(this.shelf.selected, k)));
    pressed(buttons, chosen.forms.indexOf(form));
    element("forms").replaceChildren(...(buttons.length < 2 ? [] : buttons));
    element("known").replaceChildren(...listed({ ...chosen.known, ...form.known }));
    this.fitting.describe();
    this.code.describe();
    const [, ...lines] = this.caption();
    element("caption").replaceChildren(made("strong", {}, chosen.name), " ", lines.join(" "));
    element("picture").setAttribute("aria-label", `${chosen.name}, ${form.label}; arrow keys turn it`);
  }

  // Lines below the picture: the material, and how it is held, with its bytes and error where known.
  caption() {
    const { chosen, form } = this;
    if (!chosen) return [document.title];
    const { Bytes: bytes, "Held-out loss": loss } = form.known, against = Object.keys(form.known).find((key) => key.startsWith("Against "));
    const facts = [KINDS[kindOf(form)], bytes && `${bytes} bytes`, against ? `${against.toLowerCase()}: ${form.known[against]}` : loss && `held-out loss ${loss}`];
    return [chosen.name, facts.filter(Boolean).join(" \u00b7 ")];
  }

  title() {
    return this.chosen?.name ?? document.title;
  }

  // Change the scene; see Renderer.change.
  scene(change) {
    this.renderer.change(change);
    this.mode?.lit?.(change);
  }

  // A frame is drawn once the last one is done: a queue of them would freeze the page.
  loop() {
    if (!this.fitting.waits() && this.renderer.done()) {
      const status = this.mode.draw();
      this.renderer.mark();
      if (element("status").textContent !== status) element("status").textContent = status;
    }
    requestAnimationFrame(() => this.loop());
  }
}
