// Keys of the whole page, and the dialog that lists them.

import { attempt, button, made } from "./dom.js";

const TYPING = "input, select, textarea, [contenteditable], dialog";

// `actions` are [keys, words, what to do with the key that was pressed]; they are left to the browser
// where something is typed, chosen or held with Ctrl, Alt or Meta. `before` is called before each.
export class Keys {
  constructor(actions, before) {
    const rows = actions.map(([, words, , shown]) => [made("dt", {}, ...shown.split(" ").flatMap((key) => [made("kbd", {}, key), " "])), made("dd", {}, words)]);
    const close = button("Close", () => this.dialog.close());
    this.dialog = made("dialog", { id: "keys", "aria-labelledby": "keys-title" },
      made("h2", { id: "keys-title" }, "Keys"), made("dl", {}, ...rows.flat()), close);
    document.body.append(this.dialog);
    this.dialog.addEventListener("click", (event) => event.target === this.dialog && this.dialog.close());
    addEventListener("keydown", (event) => {
      const { key, target } = event;
      if (event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey || target.closest?.(TYPING)) return;
      const found = actions.find(([keys]) => keys.includes(key));
      if (!found) return;
      event.preventDefault();
      attempt(() => {
        before();
        return found[2](key);
      });
    });
  }

  show() {
    this.dialog.showModal();
  }
}
