// Modes of the page, and the one that shows a material on its stage.

import { element, made } from "./dom.js";

const CONVERGED = 64; // frames: noise is about what screens show
export const LAST = 256; // nothing is seen to change
const SQUARE = 512; // pixels along an edge of pictures of other modes
const AREA = 1 << 20, SOFTLY = 1 << 19; // pixels of this one at most, and where software draws

// A word on how far a picture is.
export const state = (frames, whole = CONVERGED) => (frames < whole ? `refining, ${Math.round((100 * frames) / whole)} %` : "converged");

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
    this.staged = title === "Look";
    if (this.staged) new ResizeObserver(() => this.page.mode === this && this.fit()).observe(element("frame"));
  }

  open() {
    if (this.staged) this.fit();
    super.open();
  }

  // As many pixels as the picture has on the screen.
  fit() {
    const { renderer, controls } = this.page, { clientWidth, clientHeight } = element("frame"), ratio = window.devicePixelRatio || 1;
    const wanted = `${clientWidth} ${clientHeight} ${ratio}`;
    if (wanted === this.fitted || !clientWidth || !clientHeight) return;
    Object.assign(this, { fitted: wanted, whole: null });
    const most = renderer.software ? SOFTLY : AREA;
    const scale = Math.min(ratio, Math.sqrt(most / (clientWidth * clientHeight)));
    renderer.resize(...(this.size = [clientWidth, clientHeight].map((length) => Math.max(Math.round(length * scale), 1))));
    controls.framed();
  }

  close() {
    const { renderer } = this.page;
    this.refine();
    if (`${renderer.size}` === `${this.size}`) renderer.resize(SQUARE, SQUARE);
    this.fitted = null;
    super.close();
  }

  // The material has changed.
  changed() {
    const { page } = this;
    page.renderer.show(page.materials.shown(page.form));
  }

  // Where software draws, a picture begins with one of a quarter of its pixels, and stays there while it
  // is turned.
  sketch() {
    const { renderer } = this.page, { size } = renderer;
    if (this.whole && `${size}` !== `${this.half}`) this.whole = null; // resized by others
    if (renderer.frames) return this.refine();
    if (this.whole) return;
    this.half = size.map((length) => Math.ceil(length / 2));
    renderer.resize(...this.half);
    this.whole = size;
  }

  // All pixels, from the first frame on.
  refine() {
    if (this.whole) this.page.renderer.resize(...this.whole);
    this.whole = null;
  }

  // One more frame if it helps; returns a word on how far the picture is.
  draw() {
    const { renderer } = this.page;
    if (this.staged && renderer.software) this.sketch();
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
