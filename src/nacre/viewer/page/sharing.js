// The picture and the page's address, for others: copied, or saved with a caption.

import { made } from "./dom.js";
import { exrOf } from "./exr.js";
import { later } from "./readback.js";
import { handOver } from "./save.js";

const MARGIN = 16, LINE = 22; // CSS pixels of the caption below a saved picture

export class Sharing {
  constructor(page) {
    this.page = page;
    this.said = made("span", { id: "said", role: "status" });
  }

  tell(text) {
    this.said.textContent = text;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => (this.said.textContent = ""), 4000);
  }

  copy() {
    return this.copied(this.page.address.href, "Link copied", "Link to this view");
  }

  // Without a clipboard the text is left in a field, chosen, to be copied by hand.
  async copied(text, said, label) {
    try {
      await navigator.clipboard.writeText(text);
      this.tell(said);
    } catch {
      const field = made("textarea", { value: text, readOnly: true, rows: 1, "aria-label": label });
      this.said.replaceChildren(`Copy this: `, field);
      clearTimeout(this.timer);
      field.select();
    }
  }

  get name() {
    return this.page.title();
  }

  // What is on the canvas, with the caption below it.
  async png() {
    const { canvas } = this.page.renderer, whole = document.createElement("canvas"), lines = this.page.caption();
    const scale = Math.max(canvas.width / 640, 0.75), gap = MARGIN * scale;
    Object.assign(whole, { width: canvas.width, height: Math.round(canvas.height + 1.5 * gap + lines.length * LINE * scale) });
    const flat = whole.getContext("2d");
    flat.fillStyle = "#ffffff";
    flat.fillRect(0, 0, whole.width, whole.height);
    flat.drawImage(canvas, 0, 0);
    flat.textBaseline = "top";
    lines.forEach((line, k) => {
      flat.font = `${k ? "" : "600 "}${15 * scale}px system-ui, sans-serif`;
      flat.fillStyle = k ? "#5a5e66" : "#1d1f23";
      flat.fillText(line, gap, canvas.height + gap + k * LINE * scale, whole.width - 2 * gap);
    });
    const blob = await new Promise((done) => whole.toBlob(done));
    handOver(this.name, new Uint8Array(await blob.arrayBuffer()), "png");
    this.tell("Picture saved");
  }

  // The light that the picture was made of, before exposure and tones.
  async exr() {
    const { renderer } = this.page;
    if (!renderer.pictures.length) throw new Error("There is no light to save here.");
    const { size: [width, height], drawn } = renderer, sums = await later(renderer, renderer.pictures[0].latest);
    const pixels = new Float32Array(sums.length);
    for (let y = 0; y < height; y++)
      pixels.set(sums.subarray(4 * width * y, 4 * width * (y + 1)), 4 * width * (height - 1 - y));
    handOver(this.name, exrOf(pixels.map((x) => x / drawn), width, height), "exr");
    this.tell("Light saved as EXR");
  }
}
