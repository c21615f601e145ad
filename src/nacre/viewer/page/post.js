// Messages between the page and its workers, and between workers, taken one at a time.

export class Post {
  // `port` is a worker, the worker's own scope, or an end of a channel.
  constructor(port) {
    Object.assign(this, { port, held: [], taken: null });
    port.onmessage = ({ data }) => {
      const { taken } = this;
      this.taken = null;
      if (taken) taken(data);
      else this.held.push(data);
    };
  }

  send(data, transferred = []) {
    this.port.postMessage(data, transferred);
  }

  // The next message, once it is there.
  next() {
    return this.held.length ? Promise.resolve(this.held.shift()) : new Promise((resolve) => (this.taken = resolve));
  }
}
