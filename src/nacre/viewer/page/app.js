// The page: what it holds, what is chosen, and the mode that shows it.

import { Compare } from "./compare.js";
import { Controls } from "./controls.js";
import { attempt, attributes, button, element, keyed, listed, pressed } from "./dom.js";
import { Drop } from "./drop.js";
import { Fitting } from "./fitting.js";
import { Lobes } from "./lobes.js";
import { Look } from "./look.js";
import { Materials } from "./materials.js";
import { Renderer } from "./renderer.js";
import { Shelf } from "./shelf.js";
import { Space } from "./space.js";
import { Textures } from "./textures.js";

// In the order of their tabs.
//
// A mode has a title, a panel (an element beside the picture), a static available(page) (whether the page
// holds something for it), open(), close(), changed() (another material or form is chosen), draw() (what
// is new, on the picture; returns a word on its state), and, if it wants, lit(change) (the scene changed).
const MODES = [Look, Compare, Lobes, Space, Textures];

export class Page {
  constructor({ facts, bytes }) {
    this.renderer = new Renderer(element("picture"));
    Object.assign(this, { facts, bytes, materials: new Materials(facts, bytes, this.renderer) });
    this.controls = new Controls(this);
    this.shelf = new Shelf(this, (k) => attempt(() => this.choose(k)));
    this.drop = new Drop(this);
    this.fitting = new Fitting(this);
    this.start();
    this.loop();
  }

  // Offer the modes that have something to show.
  start() {
    const [first] = this.materials.list;
    Object.assign(this, { chosen: first, form: first?.forms[0] });
    this.modes = MODES.filter((Mode) => Mode.available(this)).map((Mode) => new Mode(this));
    const { notice } = this.facts;
    element("notice").hidden = !notice;
    element("notice").lastElementChild.textContent = notice ?? "";
    this.tabs();
    if (first) this.choose(0);
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
    mode.open();
  }

  // Show a material on the shelf in one of its forms.
  choose(k, form = 0) {
    const chosen = this.materials.list[k];
    this.materials.shown(chosen.forms[form]);
    Object.assign(this, { chosen, form: chosen.forms[form] });
    this.shelf.select(k);
    this.describe();
    this.mode.changed();
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
    element("picture").setAttribute("aria-label", `${chosen.name}, ${form.label}; arrow keys turn it`);
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
