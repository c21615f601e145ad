// The mode that shows what lies between materials: a map of them, and codes decoded as they are needed.

import { Decoder } from "./decoder.js";
import { attempt, button, element, made } from "./dom.js";
import { Look } from "./look.js";
import { Map2d, weightsAt } from "./map.js";
import { bytesOf, handOver } from "./save.js";
import { readTensors } from "./tensors.js";

const NAMED = 3; // materials that a mixture is named after

export class Space extends Look {
  static available(page) {
    return Boolean(page.facts.space);
  }

  constructor(page) {
    super(page, "Space");
    const space = (this.space = page.facts.space), { list } = page.materials;
    this.decoder = new Decoder(readTensors(page.bytes(space.part).buffer));
    const { values } = this.decoder.tensors.places;
    this.places = space.materials.map((_, k) => [values[2 * k], values[2 * k + 1]]);
    const materials = space.materials.map((index) => ({ name: list[index].name, picture: page.shelf.picture(index) }));
    this.map = new Map2d(this.places, materials, space.edge,
      (place) => attempt(() => this.go(place)), (k) => attempt(() => page.choose(space.materials[k])));
    this.parts = made("ul", { className: "parts" });
    const save = button("Save this material", () => this.save()), keep = button("Put it on the shelf", () => this.keep());
    this.panel.append(this.map.svg, this.parts, made("div", { className: "buttons" }, save, keep),
      made("p", { className: "quiet small" }, `Every place stands for ${this.decoder.codeDim} numbers, mixed from those of the materials \
around it and decoded to a network here. At a material that is close to it, not the same.`));
  }

  // Another material is chosen: go there, or show it as it is if it is not on the map.
  changed() {
    const k = this.space.materials.indexOf(this.page.materials.list.indexOf(this.page.chosen));
    if (k >= 0) return this.go(this.places[k]);
    if (!this.file) this.go([0.5, 0.5]);
    this.old = false;
    super.changed();
  }

  go(place) {
    this.place = place.map((x) => Math.min(Math.max(x, 0), 1));
    this.weights = weightsAt(this.places, this.place).sort((a, b) => b[1] - a[1]);
    this.map.show(this.place, this.weights);
    const whole = this.weights.map(([k, weight]) => [this.named(k), Math.round(100 * weight)]);
    const percents = whole.filter(([, part]) => part > 0), named = percents.slice(0, NAMED);
    this.name = percents.length < 2 ? percents[0][0] : named.map(([name, part]) => `${part} % ${name}`).join(", ");
    const bar = (name, value) => made("meter", { min: 0, max: 100, value, "aria-label": name });
    this.parts.replaceChildren(...percents.map(([name, part]) =>
      made("li", {}, bar(name, part), made("span", {}, name), made("span", {}, `${part} %`))));
    this.old = true;
  }

  named(k) {
    return this.page.materials.list[this.space.materials[k]].name;
  }

  // Decode the material at the place, unless this is done.
  decode() {
    if (!this.old) return;
    const { page } = this;
    this.old = false;
    this.file = this.decoder.network(this.decoder.mixed(this.weights), this.name);
    const { renderer, materials } = page, before = renderer.pictures[0]?.program;
    // Each code has a program of its own where the processor draws.
    this.material = renderer.software ? { glsl: materials.network(this.file) } : materials.varying(this.file);
    renderer.show(this.material);
    const { program } = renderer.pictures[0];
    if (before === this.own && before !== program) renderer.forget(before);
    this.own = program;
    element("name").textContent = this.name;
    element("picture").setAttribute("aria-label", `${this.name}; arrow keys turn it`);
    element("forms").replaceChildren();
    element("known").replaceChildren();
  }

  draw() {
    this.decode();
    return super.draw();
  }

  save() {
    this.decode();
    handOver(this.name, bytesOf(this.file));
  }

  keep() {
    this.decode();
    const { name, file } = this;
    this.page.add({ name, group: "From the map", known: {}, forms: [{ label: "Network", known: {}, network: file }] });
  }
}
