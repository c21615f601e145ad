// Elements of the page.

export const element = (id) => document.getElementById(id);

// An element with properties and what is inside; names with a dash or "role" become attributes.
export function made(tag, facts = {}, ...inside) {
  const found = document.createElement(tag);
  for (const [name, value] of Object.entries(facts))
    if (name.includes("-") || name === "role" || name === "for") found.setAttribute(name, value);
    else found[name] = value;
  found.append(...inside);
  return found;
}

// Show an error; "" hides it.
export function say(text) {
  element("trouble").hidden = !text;
  element("trouble").textContent = text;
}

// Do something, or wait for it; an error is shown, and the page goes on.
export async function attempt(change) {
  say("");
  try {
    await change();
  } catch (error) {
    say(error.message);
  }
}

// A button that calls `press`; `label` may be elements.
export function button(label, press, facts = {}) {
  const found = made("button", { type: "button", ...facts }, ...[label].flat());
  found.addEventListener("click", () => attempt(press));
  return found;
}

// Call with the entry of `steps` for a key that is pressed on an element.
export function keyed(target, steps, change) {
  target.addEventListener("keydown", (e) => {
    if (!(e.key in steps) || e.altKey || e.ctrlKey || e.metaKey) return;
    e.preventDefault();
    change(steps[e.key]);
  });
}

// Call with the events of a pointer that moves after it was pressed on an element. `begin` is called
// with the press; it may return false to ignore it.
export function held(target, move, begin = () => true) {
  target.addEventListener("pointerdown", (e) => {
    if (begin(e) !== false) target.setPointerCapture(e.pointerId);
  });
  target.addEventListener("pointermove", (e) => {
    if (target.hasPointerCapture(e.pointerId)) move(e);
  });
}

// Where an event is in an element, in parts of its width and height.
export function placeIn(target, { clientX, clientY }) {
  const { left, top, width, height } = target.getBoundingClientRect();
  return [(clientX - left) / width, (clientY - top) / height];
}

// Show which one of some buttons is on.
export const pressed = (buttons, chosen) =>
  buttons.forEach((each, k) => each.setAttribute("aria-pressed", `${k === chosen}`));

// Terms and their descriptions, for a <dl>.
export const listed = (facts) =>
  Object.entries(facts).flatMap(([key, value]) => [made("dt", {}, key), made("dd", {}, value)]);

const SVG = "http://www.w3.org/2000/svg";

export function drawn(tag, facts = {}, ...inside) {
  const found = document.createElementNS(SVG, tag);
  attributes(found, facts);
  found.append(...inside);
  return found;
}

export function attributes(target, facts) {
  for (const [name, value] of Object.entries(facts)) target.setAttribute(name, value);
}

// A labelled range; `change` is called with its number.
export function range(label, [min, max, step, value], change) {
  const input = made("input", { type: "range", min, max, step, value });
  input.addEventListener("input", () => attempt(() => change(Number(input.value))));
  return made("label", {}, label, input);
}

// A labelled choice of [value, text] pairs; `change` is called with the value.
export function choice(label, pairs, change) {
  const select = made("select", {}, ...pairs.map(([value, text]) => made("option", { value, textContent: text })));
  select.addEventListener("change", () => attempt(() => change(select.value)));
  return made("label", {}, label, select);
}
