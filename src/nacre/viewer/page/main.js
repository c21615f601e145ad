// Start of the page.

import { Page } from "./app.js";
import { unpacked } from "./container.js";
import { element } from "./dom.js";

unpacked(element("data").textContent)
  .then((found) => void (window.page = new Page(found)))
  .catch((error) => {
    element("trouble").hidden = false;
    element("trouble").textContent = error.message;
    document.body.dataset.mode = "none";
  });
