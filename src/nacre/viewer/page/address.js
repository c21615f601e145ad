// The state of the page in its address, after the "#", and the last states for undo.
//
// What is as it is at first is left out; what an address says and the page does not know is ignored.

import { SETTINGS } from "./settings.js";

const LONGEST = 4000; // characters of an address that are read
const PAUSE = 300; // ms without a change after which the address follows
const KEPT = 100; // states to go back to

// Text of {name: text}, for the address.
const written = (state) =>
  Object.entries(state).map(([name, text]) => `${name}=${encodeURIComponent(text).replace(/%20/g, "+").replace(/%2C/g, ",")}`).join("&");

function parsed(hash) {
  const text = hash.replace(/^#/, "").slice(0, LONGEST);
  return Object.fromEntries(new URLSearchParams(text));
}

// {name: value} of what an address says of the scene: only what can be read.
export function sceneOf(texts) {
  const found = {};
  for (const [name, { parse }] of Object.entries(SETTINGS)) {
    if (!Object.hasOwn(texts, name)) continue;
    try {
      found[name] = parse(texts[name]);
    } catch {
      // An address of another version, or a hostile one: this setting keeps its first value.
    }
  }
  return found;
}

// Texts of the settings that are not at their first values.
export function textsOf(values, first) {
  return Object.fromEntries(Object.entries(SETTINGS)
    .map(([name, { text }]) => [name, text(values[name]), text(first[name])])
    .filter(([, now, before]) => now !== before)
    .map(([name, now]) => [name, now]));
}

export class Address {
  // `state` returns the page's state as texts by name; `restore` takes such texts.
  constructor(state, restore) {
    Object.assign(this, { state, restore, past: [] });
    this.go(location.hash);
    this.last = this.now();
    addEventListener("hashchange", () => {
      if (location.hash !== this.shown) this.go(location.hash);
      this.later();
    });
  }

  now() {
    return written(this.state());
  }

  go(hash) {
    this.restore(parsed(hash));
  }

  // Something may have changed: the address follows once nothing does for a while.
  later() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.settle(), PAUSE);
  }

  settle() {
    clearTimeout(this.timer);
    const now = this.now();
    if (now === this.last) return;
    this.past.push(this.last);
    this.past.splice(0, this.past.length - KEPT);
    this.show(now);
  }

  show(text) {
    this.last = text;
    history.replaceState(null, "", `${location.href.split("#")[0]}${text ? `#${text}` : ""}`);
    this.shown = location.hash;
  }

  // Take back the last change; false where there is none.
  undo() {
    this.settle();
    if (!this.past.length) return false;
    const before = this.past.pop();
    this.go(before);
    this.show(before);
    return true;
  }

  get href() {
    this.settle();
    return location.href;
  }
}
