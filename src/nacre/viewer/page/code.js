// A network as code for other tools: a choice of languages, and buttons that copy and save it.

import { button, choice, element, made } from "./dom.js";
import { TARGETS, exported } from "./exports.js";
import { handOver } from "./save.js";

export class Code {
  constructor(page) {
    this.page = page;
    this.choice = choice("Code", Object.entries(TARGETS).map(([target, [title]]) => [target, title]), () => {});
    this.panel = made("div", { className: "buttons", role: "group", "aria-label": "Code for other tools" }, this.choice,
      button("Copy code", () => this.copy(), { title: "What nacre export writes" }), button("Save code", () => this.save()));
    element("panels").after(this.panel);
  }

  // The page shows a material, or another form of it.
  describe() {
    const { form } = this.page;
    this.panel.hidden = !this.page.facts.exports || !(form.file || form.network);
  }

  // {name, text} of the file in the chosen language.
  written() {
    const { chosen, form, facts, materials } = this.page;
    return exported(this.choice.lastChild.value, facts.exports, materials.file(form), chosen.name, form.terms);
  }

  async copy() {
    const { name, text } = this.written();
    await this.page.sharing.copied(text, `${name} copied`, name);
  }

  save() {
    const { name, text } = this.written(), [, stem, ending] = name.match(/^(.*)\.(.*)$/);
    handOver(stem, new TextEncoder().encode(text), ending);
  }
}
