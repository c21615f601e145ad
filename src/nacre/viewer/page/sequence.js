// An additive recurrence that covers the unit square evenly (Roberts 2018).

// Powers of the plastic number.
export const FIRST = 0.7548776662466927;
export const SECOND = 0.5698402909980532;

// By how much of a pixel a frame's points are moved across and up: not at all in the first.
export const moved = (frame) =>
  frame ? [FIRST, SECOND].map((step) => ((step * (frame + 0.5)) % 1) - 0.5) : [0, 0];
