// Modes of the page, and the one that turns a shape in the light.

import { made } from "./dom.js";

const CONVERGED = 64; // frames: noise is about what screens show
export const LAST = 256; // nothing is seen to change

// A word on how far a picture is.
export const state = (frames, whole = CONVERGED) => (frames < whole ? `${Math.round((100 * frames) / whole)} %` : "converged");

// What modes share: see app.js.
export class Mode {
  static available(page) {
    return page.materials.list.length > 0;
  }

  constructor(page, title, panel = made("div")) {
    Object.assign(this, { page, title, panel });
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

  open() {
    this.page.renderer.change({ stage: true, film: true });
    super.open();
  }

  close() {
    this.page.renderer.change({ stage: false, film: false });
    super.close();
  }

  // The material has changed.
  changed() {
    const { page } = this;
    page.renderer.show(page.materials.shown(page.form));
  }

  // One more frame if it helps; returns a word on how far the picture is.
  draw() {
    const { renderer } = this.page;
    if (renderer.frames < LAST) renderer.frame();
    // Smoothing takes as long as a frame where software draws: later frames are shown less often.
    const { frames } = renderer, due = frames < 4 || frames === LAST || frames >= 1.25 * this.shown;
    if (renderer.stale || frames < this.shown || (due && frames !== this.shown)) {
      renderer.present();
      this.shown = frames;
    }
    return state(frames);
  }
}
