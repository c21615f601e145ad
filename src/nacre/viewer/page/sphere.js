// Start of a page that is one picture.

import { unpacked } from "./container.js";
import { element } from "./dom.js";
import { Materials } from "./materials.js";
import { View } from "./view.js";

unpacked(element("data").textContent).then(({ facts, bytes }) => {
  const host = element("view"), view = new View(host, { facts, bytes }), [{ name, forms }] = facts.materials;
  host.view = view;
  view.start();
  view.show((context) => new Materials(facts, bytes, context).shown(forms[0]), name);
});
