// Files that are dropped onto the page, or chosen with a button: each becomes a material on the shelf.

import { attempt, button, element, made } from "./dom.js";
import { ENDINGS, Reading } from "./files.js";

const LONGEST = 200; // characters of a name that are shown
const GROUP = "Opened here";
const SIZE = 96, FRAMES = 32; // of small pictures
const SCENE = { shape: "sphere", turn: [1, 0, 0, 0, 1, 0, 0, 0, 1], surroundings: 1, irradiance: [0, 0, 0], exposure: 1, still: false, stage: false, film: false };

export class Drop {
  constructor(page) {
    this.page = page;
    this.last = Promise.resolve();
    const input = made("input", { type: "file", multiple: true, accept: ENDINGS.join(","), hidden: true });
    const title = `${ENDINGS.join(", ")}; or drop them anywhere on the page`;
    this.state = made("p", { id: "reading", role: "status", className: "quiet" });
    this.veil = made("div", { id: "veil", hidden: true }, made("p", {}, `Drop ${ENDINGS.join(", ")} files to see them`));
    input.addEventListener("change", () => {
      this.open([...input.files]);
      input.value = "";
    });
    element("search").after(button("Open files…", () => input.click(), { id: "open", title }), input, this.state);
    document.body.append(this.veil);
    this.listen();
  }

  listen() {
    const files = (event) => event.dataTransfer?.types.includes("Files");
    addEventListener("dragover", (event) => {
      if (!files(event)) return;
      event.preventDefault();
      this.veil.hidden = false;
    });
    addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) this.veil.hidden = true;
    });
    addEventListener("drop", (event) => {
      this.veil.hidden = true;
      if (!files(event)) return;
      event.preventDefault();
      this.open([...event.dataTransfer.files]);
    });
  }

  // Read files one after another, after those that are being read; resolves when all are done.
  open(files) {
    this.last = this.last.then(() => attempt(() => this.all(files)));
    return this.last;
  }

  async all(files) {
    const { bytes, facts } = this.page, reading = new Reading(bytes(facts.fit.kernel)), troubles = [];
    for (const [k, file] of files.entries()) {
      const name = file.name.slice(0, LONGEST);
      const said = `Reading ${name}${files.length > 1 ? ` (${k + 1} of ${files.length})` : ""}`;
      this.state.textContent = `${said}…`;
      try {
        this.add(await reading.read(file, (part) => (this.state.textContent = `${said}, ${Math.round(100 * part)} %`)));
      } catch (error) {
        troubles.push(`${name}: ${error.message}`);
      }
    }
    reading.close();
    this.state.textContent = "";
    if (troubles.length) throw new Error(troubles.join("\n"));
  }

  add({ name, known, source, network, table, scan }) {
    const { page } = this, { File, "File bytes": size, ...own } = known;
    const form = { label: table ? "Measured" : "Network", known: own, network, table, scan };
    // A material that cannot be drawn is not added to the shelf.
    const picture = thumbnail(page.renderer, page.materials.shown(form));
    page.add({ name: name.slice(0, LONGEST), group: GROUP, known: { File, "File bytes": size }, source, forms: [form], picture });
  }
}

// A sphere with a material {glsl, textures} under the chosen environment, as a data: address. The
// renderer keeps this material, and starts again.
function thumbnail(renderer, material) {
  const { size } = renderer, scene = { ...renderer.scene };
  try {
    renderer.resize(SIZE, SIZE);
    renderer.change(SCENE);
    renderer.show(material);
    for (let k = 0; k < FRAMES; k++) renderer.frame();
    renderer.present();
    return renderer.canvas.toDataURL("image/jpeg", 0.8);
  } finally {
    renderer.resize(...size);
    renderer.change(scene);
  }
}
