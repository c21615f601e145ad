// Turning something by pointer and arrow keys.

import { held, keyed } from "./dom.js";

const KEYS = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] };

// Call with pixels across and down as something is dragged or arrow keys are pressed.
export function dragged(target, change) {
  held(target, (e) => change(e.movementX, e.movementY));
  keyed(target, KEYS, ([across, down]) => change(across, down));
}

// A view from around: `by` takes pixels across and down, and returns the scene's `turn`.
export class Turning {
  constructor() {
    this.azimuth = this.elevation = 0;
  }

  by(across, down) {
    this.azimuth += across / 150;
    this.elevation = Math.min(Math.max(this.elevation + down / 150, -1.5), 1.5);
    return this.matrix();
  }

  // The same in degrees from where it began.
  to(across, up) {
    [this.azimuth, this.elevation] = [across, up].map((degrees) => (degrees * Math.PI) / 180);
    return this.matrix();
  }

  degrees() {
    return [this.azimuth, this.elevation].map((angle) => (angle * 180) / Math.PI);
  }

  matrix() {
    const [c, s] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [d, t] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    return [c, s * t, -s * d, 0, d, t, s, -c * t, c * d];
  }
}
