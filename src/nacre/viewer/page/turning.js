// Turning something by pointer and arrow keys.

const KEYS = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] };

// Call with pixels across and down as something is dragged or arrow keys are pressed.
export function dragged(target, change) {
  target.addEventListener("pointerdown", (e) => target.setPointerCapture(e.pointerId));
  target.addEventListener("pointermove", (e) => {
    if (target.hasPointerCapture(e.pointerId)) change(e.movementX, e.movementY);
  });
  target.addEventListener("keydown", (e) => {
    if (!KEYS[e.key] || e.altKey || e.ctrlKey || e.metaKey) return;
    e.preventDefault();
    change(...KEYS[e.key]);
  });
}

// A view from around: `by` takes pixels across and down, and returns the scene's `turn`.
export class Turning {
  constructor() {
    this.azimuth = this.elevation = 0;
  }

  by(across, down) {
    this.azimuth += across / 150;
    this.elevation = Math.min(Math.max(this.elevation + down / 150, -1.5), 1.5);
    const [c, s] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [d, t] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    return [c, s * t, -s * d, 0, d, t, s, -c * t, c * d];
  }
}
