// Start of the page, and of the workers that read files and fit networks for it by the same script.

import { Page } from "./app.js";
import { unpacked } from "./container.js";
import { element, say } from "./dom.js";
import { serve } from "./files.js";
import { train } from "./training.js";

function start() {
  unpacked(element("data").textContent)
    .then((found) => void (window.page = new Page(found)))
    .catch((error) => {
      say(error.message);
      document.body.dataset.mode = "none";
    });
}

if (globalThis.document) start();
else if (globalThis.name === "fit") train();
else serve();
