// The list of materials: thumbnails, groups, search, and keys.

import { element, keyed, made } from "./dom.js";

const STEPS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1, Home: -Infinity, End: Infinity };

// How a form is held, in a word.
export const kindOf = (form) => form.kind ?? (form.table ? "measured" : "neural");

export class Shelf {
  // `choose` is called with the number of a material.
  constructor(page, choose) {
    Object.assign(this, { page, choose, items: [] });
    this.list = element("materials");
    keyed(this.list, STEPS, (step) => this.step(step));
    element("search").addEventListener("input", (e) => this.search(e.target.value));
    page.materials.list.forEach((each) => this.add(each));
  }

  add(material) {
    const k = this.items.length, src = material.picture ?? (material.thumbnail && this.packed(material.thumbnail));
    const facts = { className: "material", role: "option", id: `material-${k}`, title: material.name };
    const picture = src ? made("img", { src, alt: "", width: 96, height: 96 }) : made("span", { className: "blank" });
    const kinds = [...new Set(material.forms.map(kindOf))].map((kind) => made("span", { className: `badge ${kind}` }, kind));
    const item = made("div", facts, picture, made("span", { className: "words" }, made("span", { className: "title" }, material.name), made("span", {}, ...kinds)));
    item.addEventListener("click", () => this.choose(k));
    this.items.push(item);
    this.group(material.group ?? "").append(item);
    this.count();
  }

  // Address of a thumbnail that the page carries.
  packed(thumbnail) {
    return URL.createObjectURL(new Blob([this.page.bytes(thumbnail)], { type: "image/jpeg" }));
  }

  // Where the thumbnail of a material is; empty where it has none.
  picture(k) {
    return this.items[k].querySelector("img")?.src ?? "";
  }

  // The part of the list for a group, made when first asked for.
  group(name) {
    const known = [...this.list.children].find((each) => each.dataset.group === name);
    if (known) return known;
    const made_ = made("div", { className: "group", role: "group", "aria-label": name || "Materials" });
    made_.dataset.group = name;
    if (name) made_.append(made("h3", { role: "presentation" }, name));
    this.list.append(made_);
    return made_;
  }

  select(k) {
    this.items.forEach((item, at) => item.setAttribute("aria-selected", `${at === k}`));
    this.list.setAttribute("aria-activedescendant", this.items[k].id);
    this.reveal(this.items[k]);
    this.selected = k;
  }

  // Scroll the list, and only the list: on a narrow page the picture stays in sight.
  reveal(item) {
    const list = this.list.getBoundingClientRect(), own = item.getBoundingClientRect();
    const by = (low, high, first, last) => Math.min(low - first, 0) + Math.max(high - last, 0);
    this.list.scrollBy(by(own.left, own.right, list.left, list.right), by(own.top, own.bottom, list.top, list.bottom));
  }

  step(step) {
    const shown = [...this.list.querySelectorAll(".material:not([hidden])")];
    if (!shown.length) return;
    const at = shown.indexOf(this.items[this.selected]) + step;
    this.choose(this.items.indexOf(shown[Math.min(Math.max(at, 0), shown.length - 1)]));
  }

  search(words) {
    const wanted = words.trim().toLowerCase();
    this.page.materials.list.forEach((each, k) =>
      (this.items[k].hidden = !`${each.name} ${each.group ?? ""}`.toLowerCase().includes(wanted)));
    for (const group of this.list.children) group.hidden = ![...group.querySelectorAll(".material")].some((item) => !item.hidden);
    this.count();
  }

  count() {
    const shown = this.items.filter((item) => !item.hidden).length;
    element("count").textContent = shown === this.items.length ? `${shown}` : `${shown} of ${this.items.length}`;
  }
}
