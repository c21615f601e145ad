// The page's materials, and what the renderer needs of them.
//
// A material is {name, known, group, forms} with a `thumbnail` (a part of the page) or a `picture` (its
// address); a form of it is {label, known} with one of `file` (a network's) and `glsl` (a formula's),
// names of parts; `table` (see tables.js), whose grids hold their values or the name of their part; or
// `network` (a file that was read).

import { filled, keyOf, numbersFor, open, opened, place, written } from "./programs.js";
import { shown } from "./tables.js";
import { readTensors } from "./tensors.js";

export class Materials {
  // `context` is what textures are made in.
  constructor(facts, bytes, context) {
    Object.assign(this, { list: facts.materials, sampler: facts.sampler, inputs: facts.inputs, bytes, context, read: new Map() });
    this.templates = new Map(facts.templates.map((each) => [JSON.stringify(JSON.parse(each.key)), each]));
  }

  // A name that no other material has, for addresses.
  title(material) {
    const alike = this.list.filter(({ name }) => name === material.name), k = alike.indexOf(material);
    return k > 0 ? `${material.name}~${k + 1}` : material.name;
  }

  // {glsl, textures} of a form.
  shown(form) {
    if (!this.read.has(form)) this.read.set(form, this.reading(form));
    return this.read.get(form);
  }

  reading(form) {
    if (form.glsl) return { glsl: new TextDecoder().decode(this.bytes(form.glsl)) };
    if (form.table) return shown(this.context, this.whole(form.table), this.sampler);
    return { glsl: this.network(this.file(form)) };
  }

  // The file of a form that is a network.
  file(form) {
    return form.network ?? (form.opened ??= readTensors(this.bytes(form.file).buffer));
  }

  // Take in those of another file of the page.
  join({ materials, templates }) {
    for (const each of templates) this.templates.set(JSON.stringify(JSON.parse(each.key)), each);
    return materials;
  }

  // A table with the numbers of its parts.
  whole(table) {
    const grids = Object.entries(table.grids).map(([name, grid]) => {
      if (grid.values) return [name, grid];
      const { buffer } = this.bytes(grid.part);
      return [name, { ...grid, values: grid.half ? new Uint16Array(buffer) : new Float32Array(buffer) }];
    });
    return { ...table, grids: Object.fromEntries(grids) };
  }

  // GLSL of a network's file; where no template has its shape, with a sampler that serves any material.
  network(file) {
    const template = this.template(file);
    return template ? filled(template, file) : written(file, this.inputs, this.sampler);
  }

  // {glsl, textures} of a network's file, of the same GLSL for all of its shape: for those that change
  // while they are looked at.
  varying(file) {
    const template = this.template(file), found = template ? numbersFor(template, file) : [];
    const glsl = template ? open(template) : opened(written(file, this.inputs, this.sampler, (x) => place(found.push(x) - 1)), found.length);
    const numbers = new Float32Array(4 * Math.ceil(found.length / 4));
    numbers.set(found);
    return { glsl, textures: { material_numbers: numbers } };
  }

  template(file) {
    return this.templates.get(JSON.stringify(keyOf(file.header)));
  }
}
