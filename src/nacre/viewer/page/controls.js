// Shape, light and exposure; turning the shape and moving the lamp on the picture.

import { attempt, choice, element, made, range } from "./dom.js";
import { Turning, dragged } from "./turning.js";

const SHAPES = [["sphere", "Sphere"], ["ball", "Ball"], ["cloth", "Cloth"], ["knot", "Knot"]];
const DISTANCE = 2.5; // of the lamp, in radii of the shape

export class Controls {
  constructor(page) {
    this.page = page;
    this.view = new Turning();
    this.lamp = { x: -0.5, y: 0.5 };
    const lights = page.facts.environments.map((each, k) => [k, each.name]);
    element("controls").append(
      choice("Shape", SHAPES, (shape) => page.scene({ shape })),
      choice("Light", [...lights, ["none", "Lamp alone"]], (k) => this.light(k)),
      range("Rotation", [-180, 180, 1, 0], (x) => page.scene({ rotation: (x * Math.PI) / 180 })),
      range("Exposure", [-4, 4, 0.1, 0], (x) => page.scene({ exposure: 2 ** x })),
      range("Lamp", [0, 4, 0.1, 0], (x) => this.shine(x)),
    );
    for (const each of element("controls").children) each.dataset.control = each.firstChild.textContent.toLowerCase();
    this.strength = element("controls").lastChild.firstElementChild;
    this.handle = made("button", { id: "lamp", type: "button", title: "Lamp: drag it, or move it with the arrow keys", "aria-label": "Lamp", hidden: true });
    element("frame").append(this.handle);
    this.dragged(element("picture"), (across, down) => page.scene({ turn: this.view.by(across, down) }));
    this.dragged(this.handle, (across, down) => {
      const { canvas, size } = page.renderer, radius = (canvas.clientWidth / 2) * (size[0] / canvas.width);
      this.move(this.lamp.x + across / radius, this.lamp.y - down / radius);
    });
    this.light(0);
    this.move(this.lamp.x, this.lamp.y);
  }

  // The same as `dragged` in turning.js, with errors shown.
  dragged(target, change) {
    dragged(target, (across, down) => attempt(() => change(across, down)));
  }

  light(k) {
    if (k !== "none") {
      this.page.renderer.light(this.page.facts.environments[k], this.page.bytes);
    } else if (Number(this.strength.value) === 0) {
      this.strength.value = 1;
      this.shine(1);
    }
    this.page.scene({ surroundings: k === "none" ? 0 : 1 });
  }

  // A white surface at the middle of the shape that faces the lamp has the radiance `strength`.
  shine(strength) {
    this.handle.hidden = strength === 0;
    this.page.scene({ irradiance: Array(3).fill(Math.PI * strength * DISTANCE ** 2) });
  }

  // Put the lamp before the shape, where its direction is seen at x and y.
  move(x, y) {
    const length = Math.max(Math.hypot(x, y) / 0.98, 1);
    this.lamp = { x: x / length, y: y / length };
    const z = Math.sqrt(1 - this.lamp.x ** 2 - this.lamp.y ** 2);
    this.page.scene({ lamp: [...[this.lamp.x, this.lamp.y, z].map((a) => a * DISTANCE), 1] });
    this.handle.style.setProperty("--x", `${this.lamp.x}`);
    this.handle.style.setProperty("--y", `${this.lamp.y}`);
  }
}
