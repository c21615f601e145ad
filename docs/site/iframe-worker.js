// Browsers start no worker from a page on disk: there the script of the search runs in a frame.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      const inner = frame.contentWindow;
      inner.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
      const script = inner.document.createElement("script");
      this.loaded = new Promise((resolve) => { script.onload = () => resolve(inner); });
      script.src = url;
      inner.document.body.append(script);
    }

    async postMessage(data) {
      const inner = await this.loaded;
      inner.dispatchEvent(new MessageEvent("message", { data }));
    }
  };
}
