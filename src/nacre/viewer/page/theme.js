// Dark or light: as the system says, until the reader does.

import { button } from "./dom.js";

export class Theme {
  constructor() {
    this.system = matchMedia("(prefers-color-scheme: dark)");
    this.button = button("", () => this.turn());
    this.system.addEventListener("change", () => this.label());
    this.label();
  }

  get dark() {
    const { theme } = document.documentElement.dataset;
    return theme ? theme === "dark" : this.system.matches;
  }

  turn() {
    document.documentElement.dataset.theme = this.dark ? "light" : "dark";
    this.label();
  }

  label() {
    this.button.textContent = this.dark ? "Light page" : "Dark page";
  }
}
