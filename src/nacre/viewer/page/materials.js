// The page's materials, and what the renderer needs of them.
//
// A material is {name, known, thumbnail, group, forms}; a form of it is {label, known} with one of
// `file` (a network's), `glsl` (a formula's) or another part of the page by whose name it is read.

import { filled, keyOf } from "./programs.js";
import { FileError, readTensors } from "./tensors.js";

export class Materials {
  constructor(facts, bytes) {
    Object.assign(this, { list: facts.materials, bytes, read: new Map() });
    this.templates = new Map(facts.templates.map((each) => [JSON.stringify(JSON.parse(each.key)), each]));
  }

  // {glsl, textures} of a form.
  shown(form) {
    if (!this.read.has(form)) this.read.set(form, this.reading(form));
    return this.read.get(form);
  }

  reading(form) {
    if (form.glsl) return { glsl: new TextDecoder().decode(this.bytes(form.glsl)) };
    return { glsl: this.network(readTensors(this.bytes(form.file).buffer)) };
  }

  // GLSL of a network's file.
  network(file) {
    const template = this.templates.get(JSON.stringify(keyOf(file.header)));
    if (!template) throw new FileError("is a network of a shape that this page does not hold");
    return filled(template, file);
  }
}
