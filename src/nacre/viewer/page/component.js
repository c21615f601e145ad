// <nacre-view src="gold.safetensors" shape="ball" light="room" exposure="0.5" stage alt="Gold"></nacre-view>
//
// Beside `src` and `alt`, attributes are named as in addresses of the page (see settings.js). They may
// change at any time. `load` is dispatched once a picture has converged, `error` (with words as detail)
// where something fails.

import { unpacked } from "./container.js";
import { Materials } from "./materials.js";
import { PACKED } from "./packed.js";
import { FileError, LIMIT, readTensors } from "./tensors.js";
import { VIEWED, View } from "./view.js";

const packed = unpacked(PACKED);

class NacreView extends HTMLElement {
  static observedAttributes = ["src", "alt", ...VIEWED];

  async connectedCallback() {
    const held = await packed;
    if (!this.isConnected) return;
    if (!this.view) {
      this.view = new View(this, held);
      this.materials = new Materials(held.facts, held.bytes);
      for (const name of NacreView.observedAttributes) if (this.hasAttribute(name)) this.attributeChangedCallback(name);
    }
    this.view.start();
  }

  disconnectedCallback() {
    this.view?.stop();
  }

  attributeChangedCallback(name) {
    if (!this.view) return;
    const text = this.getAttribute(name) ?? "";
    if (name === "alt") this.view.label(text);
    else if (name === "src") this.load(text);
    else this.view.set(name, name === "stage" && this.hasAttribute(name) ? text || "on" : text);
  }

  async load(src) {
    this.asked?.abort();
    const { signal } = (this.asked = new AbortController());
    const { view } = this, name = decoded(src.split(/[?#]/)[0].split("/").pop());
    view.say("src", "");
    view.say("picture", "");
    if (!src) return view.show(null);
    try {
      const file = readTensors(await fetched(src, signal));
      const material = { glsl: this.materials.network(file) };
      if (!signal.aborted) view.show(() => material, file.header.name || name);
    } catch (error) {
      if (signal.aborted) return;
      view.show(null);
      view.say("src", `${name}: ${error.message}`);
    }
  }
}

for (const name of NacreView.observedAttributes)
  Object.defineProperty(NacreView.prototype, name, {
    get() { return this.getAttribute(name) ?? ""; },
    set(value) { this.setAttribute(name, value); },
  });

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

// The bytes of an address: never more than a file of this kind has.
async function fetched(src, signal) {
  let response;
  try {
    response = await fetch(new URL(src, document.baseURI), { signal });
  } catch {
    throw new FileError(location.protocol === "file:"
      ? "cannot be fetched by a page that was opened from disk; serve its folder"
      : "cannot be fetched; another site has to allow it (CORS)");
  }
  if (!response.ok) throw new FileError(`cannot be fetched: ${response.status} ${response.statusText}`);
  const parts = [];
  let size = 0;
  for (const reader = response.body.getReader(); ;) {
    const { done, value } = await reader.read();
    if (done) return new Blob(parts).arrayBuffer();
    parts.push(value);
    size += value.length;
    if (size > LIMIT) {
      await reader.cancel();
      throw new FileError(`is larger than ${LIMIT} bytes`);
    }
  }
}

if (!customElements.get("nacre-view")) customElements.define("nacre-view", NacreView);
