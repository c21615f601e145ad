// What makes a neural material of one that the page shows: a button, how far it is, and the file.

import { button, choice, element, made } from "./dom.js";
import { Fit } from "./fit.js";
import { Look } from "./look.js";
import { bytesOf, handOver } from "./save.js";
import { kindOf } from "./shelf.js";
import { sizeOf } from "./tensors.js";

const FEW = 3, SPARSE = 1500; // frames of a network, and ms between two, where the processor draws them
const SHORT = { draft: "Neural, draft", standard: "Neural" };

export class Fitting {
  constructor(page) {
    this.page = page;
    this.panel = made("div", { className: "fitting" });
    this.said = made("p", { role: "status", className: "quiet small" });
    this.bar = made("progress", { max: 1, "aria-label": "How far the fit is" });
    this.state = made("span", { className: "quiet small" });
    this.preset = choice("Quality", Object.keys(SHORT).map((name) => [name, name]), () => {});
    this.make = button("Make it neural", () => this.start(), { title: "Fit a small network to this material, in this page" });
    this.stop = button("Cancel", () => this.fit.cancel());
    this.save = button("Save network", () => this.saved());
    this.idle = made("div", { className: "buttons" }, this.preset, this.make, this.save);
    this.busy = made("div", { className: "buttons", hidden: true }, this.bar, this.state, this.stop);
    this.panel.append(this.idle, this.busy, this.said);
    element("forms").after(this.panel);
    if (!page.facts.fit) this.panel.hidden = true;
    else if (!globalThis.WebAssembly?.validate(page.bytes(page.facts.fit.kernel))) this.refuse();
  }

  refuse() {
    this.make.hidden = this.preset.hidden = true;
    this.said.textContent = "This browser has no WebAssembly with SIMD, which fits of networks need.";
  }

  // The page shows a material, or another form of it.
  describe() {
    const { form, chosen } = this.page;
    this.save.hidden = !form.fitted;
    // A material that is a network already needs none.
    this.idle.hidden = Boolean(this.fit) || (!form.fitted && chosen.forms.every((each) => kindOf(each) === "neural"));
  }

  async start() {
    const { page } = this, { chosen, form, renderer, materials, facts } = page, preset = this.preset.lastChild.value;
    const source = form.fitted ? chosen.forms.find((each) => !each.fitted) : form;
    Object.assign(this, { chosen, made: null });
    this.turn(true, `Fitting a network to ${chosen.name}…`);
    try {
      this.fit = new Fit(renderer, facts.fit, page.bytes(facts.fit.kernel), materials.shown(source), preset, source.scan);
      const network = await this.fit.run((news) => this.report(news, preset));
      const seconds = ((performance.now() - this.fit.began) / 1000).toFixed(1), { held_out_loss: loss } = network.header.quality;
      network.header.name = chosen.name;
      if (chosen.source) network.header.source = chosen.source;
      this.show(network, preset, { Model: "NeuralBrdf", Layers: network.header.sizes.join("-"), Bytes: sizeOf(network.tensors).bytes.toLocaleString("en"), "Held-out loss": loss.toPrecision(3), "Fitted in": `${seconds} s, in this page` });
      this.turn(false, `${chosen.name}: a network in ${seconds} s, held-out loss ${loss.toPrecision(3)}.`);
    } catch (error) {
      this.drop();
      this.turn(false, error.message === "cancelled" ? "Cancelled." : "");
      if (error.message !== "cancelled") throw new Error(`${chosen.name}: ${error.message}`);
    } finally {
      this.fit = null;
    }
  }

  turn(busy, said) {
    this.busy.hidden = !busy;
    this.idle.hidden = busy;
    this.bar.removeAttribute("value");
    this.state.textContent = "";
    this.said.textContent = said;
  }

  report({ sampled, progress, loss, network }, preset) {
    if (sampled !== undefined) this.state.textContent = "Sampling…";
    if (progress === undefined) return;
    this.bar.value = progress;
    const seconds = ((performance.now() - this.fit.began) / 1000).toFixed(0);
    this.state.textContent = `${Math.round(100 * progress)} %, held-out loss ${loss.toPrecision(3)}, ${seconds} s`;
    const now = performance.now();
    if (this.made && this.page.renderer.software && now - this.drawn < SPARSE) return;
    this.drawn = now;
    this.show(network, preset);
  }

  // Put a network in the place of the one before, and on the picture where that shows it.
  show(network, preset, known = null) {
    const { page, chosen } = this, { renderer, materials } = page, first = !this.made;
    if (first) {
      const at = chosen.forms.findIndex(({ label }) => label === SHORT[preset]), form = { label: SHORT[preset], known: {}, fitted: true };
      const [old] = chosen.forms.splice(at < 0 ? chosen.forms.length : at, at < 0 ? 0 : 1, form);
      materials.read.delete(old);
      Object.assign(this, { made: form, before: old, old: old?.program });
    }
    const form = this.made, shows = page.form === form || (first && page.chosen === chosen);
    Object.assign(form, { network, known: known ?? {} });
    // Programs of their own draw faster in software, but take it a second to compile.
    const compiled = known && renderer.software;
    materials.read.set(form, compiled ? { glsl: materials.network(network) } : materials.varying(network));
    if (shows && (first || known)) page.choose(page.materials.list.indexOf(chosen), chosen.forms.indexOf(form));
    else if (known ? page.chosen === chosen : shows && page.mode instanceof Look) page.mode.changed();
    if (shows && compiled) form.program = renderer.pictures[0]?.program;
    if (this.old && renderer.pictures.every(({ program }) => program !== this.old)) renderer.forget(this.old);
    this.old = null;
  }

  // Whether the picture should wait: directions are being evaluated, or the processor that trains would
  // have to draw more than it takes to see what has changed.
  waits() {
    const { frames, software } = this.page.renderer;
    return Boolean(this.fit) && frames > 0 && (!this.made || (frames >= FEW && software));
  }

  // Take an unfinished network away; the one before comes back.
  drop() {
    const { page, chosen, made: form, before } = this;
    if (!form) return;
    chosen.forms.splice(chosen.forms.indexOf(form), 1, ...(before ? [before] : []));
    page.materials.read.delete(form);
    if (page.form === form) page.choose(page.materials.list.indexOf(chosen), Math.max(0, chosen.forms.indexOf(before)));
    else if (page.chosen === chosen) page.describe();
  }

  saved() {
    const { network } = this.page.form;
    handOver(this.page.chosen.name, bytesOf(network));
  }
}
