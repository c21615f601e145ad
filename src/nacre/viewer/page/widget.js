// A picture in a notebook that follows what Python sets: see nacre.viewer.widget.

import { opened } from "./container.js";
import { Materials } from "./materials.js";
import { View } from "./view.js";

const TRAITS = ["shape", "light", "exposure"];

export async function render({ model, el }) {
  const host = el.appendChild(document.createElement("div"));
  let view;
  const materials = async () => {
    const { buffer, byteOffset, byteLength } = model.get("content");
    const { facts, bytes } = await opened(new Uint8Array(buffer, byteOffset, byteLength));
    view?.stop();
    view = host.view = new View(host, { facts, bytes });
    for (const name of TRAITS) view.set(name, `${model.get(name)}`);
    resize();
    view.start();
    const [{ name, forms }] = facts.materials;
    view.show((context) => new Materials(facts, bytes, context).shown(forms[0]), name);
  };
  const resize = () => Object.assign(host.style, { width: `${model.get("size")}px`, height: `${model.get("size")}px` });
  for (const name of TRAITS) model.on(`change:${name}`, () => view?.set(name, `${model.get(name)}`));
  model.on("change:content", materials);
  model.on("change:size", resize);
  await materials();
  return () => view.stop();
}
