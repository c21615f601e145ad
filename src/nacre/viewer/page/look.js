// Modes of the page, and the one that turns a shape in the light.

import { made } from "./dom.js";

const CONVERGED = 64; // frames: noise is about what screens show
export const LAST = 256; // nothing is seen to change

// A word on how far a picture is.
export const state = (frames, whole = CONVERGED) => (frames < whole ? `${Math.round((100 * frames) / whole)} %` : "converged");

// What modes share: see app.js.
export class Mode {
  constructor(page, title, panel = made("div")) {
    Object.assign(this, { page, title, panel });
  }

  available() {
    return true;
  }

  open() {
    this.changed();
  }

  changed() {}

  close() {
    this.page.describe();
  }
}

export class Look extends Mode {
  constructor(page, title = "Look") {
    super(page, title);
  }

  // The material or what it is shown on has changed.
  changed() {
    const { page } = this;
    page.renderer.show(page.materials.shown(page.form));
  }

  // One frame where it is of use; a word on how far the picture is.
  draw() {
    const { renderer } = this.page;
    if (renderer.frames < LAST) renderer.frame();
    else if (!renderer.stale) return state(LAST);
    renderer.present();
    return state(renderer.frames);
  }
}
