// Start of the page, and of the worker that reads files for it by the same script.

import { Page } from "./app.js";
import { unpacked } from "./container.js";
import { element, say } from "./dom.js";
import { serve } from "./files.js";

function start() {
  unpacked(element("data").textContent)
    .then((found) => void (window.page = new Page(found)))
    .catch((error) => {
      say(error.message);
      document.body.dataset.mode = "none";
    });
}

if (globalThis.document) start();
else serve();
