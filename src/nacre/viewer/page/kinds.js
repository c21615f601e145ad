// More materials for the page, in files beside it that are loaded when someone asks for them.
//
// Such a file is a script that hands over its content in the page's format, so that it can be loaded from
// disk as well, where browsers fetch nothing else.

import { unpacked } from "./container.js";
import { button, element, made } from "./dom.js";

const waiting = new Map(); // what takes the content of a file, by its name

globalThis.nacreMaterials = (name, content) => waiting.get(name)?.(content);

export class Kinds {
  constructor(page) {
    const { more = [] } = page.facts;
    Object.assign(this, { page, loading: new Map(), left: new Map(more.map((kind) => [kind.name, kind])) });
    this.buttons = new Map(more.map((kind) => [kind.name, button(label(kind), () => this.ask(kind.name), { title: kind.about ?? "" })]));
    if (more.length) element("materials").after(made("div", { id: "more", role: "group", "aria-label": "More materials" }, ...this.buttons.values()));
  }

  // Whether materials of a kind are in a file that was not loaded.
  has(name) {
    return this.left.has(name);
  }

  // Load a kind, and show the first of its materials.
  async ask(name) {
    const { page } = this, { list } = page.materials, first = list.length, textures = page.facts.textures?.length ?? 0;
    await this.load(name);
    if (list.length > first) page.choose(first);
    else page.openTexture(textures);
  }

  load(name) {
    if (!this.loading.has(name)) this.loading.set(name, this.loaded(name));
    return this.loading.get(name);
  }

  async loaded(name) {
    const { page, buttons } = this, kind = this.left.get(name), own = buttons.get(name);
    own.disabled = true;
    own.textContent = `Loading ${kind.title}…`;
    try {
      page.join(await unpacked(await script(kind)), name);
      this.left.delete(name);
      own.remove();
    } catch {
      this.loading.delete(name);
      own.disabled = false;
      own.textContent = label(kind);
      throw new Error(`${kind.src} could not be loaded; it belongs beside this page.`);
    }
  }
}

const label = ({ title, count, size }) => `${title}: ${count} more, ${size}`;

// The content of a kind's file.
function script({ name, src }) {
  return new Promise((done, failed) => {
    const element_ = made("script", { src, onerror: failed, onload: failed });
    waiting.set(name, done);
    document.head.append(element_);
  });
}
