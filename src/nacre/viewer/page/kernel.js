// The compiled kernel (nacre/viewer/kernel): its functions, and room in its memory.

const { exp, log, sin, cos, atan2, pow } = Math;

export class Kernel {
  // `bytes` are the compiled module.
  constructor(bytes) {
    const { exports } = new WebAssembly.Instance(new WebAssembly.Module(bytes), { env: { exp, log, sin, cos, atan2, pow } });
    Object.assign(this, { ...exports, end: exports.memory.buffer.byteLength });
  }

  // Room for so many bytes, all zero, for as long as the kernel lives.
  room(bytes) {
    const at = this.end, { memory } = this;
    this.end += 64 * Math.ceil(bytes / 64);
    const missing = this.end - memory.buffer.byteLength;
    if (missing > 0) memory.grow(Math.ceil(missing / 65536));
    return at;
  }

  // Numbers in the memory; to be asked for again once there is new room.
  numbers(at, count, Type = Float32Array) {
    return new Type(this.memory.buffer, at, count);
  }

  // Room with numbers in it.
  put(numbers) {
    const at = this.room(numbers.byteLength);
    this.numbers(at, numbers.length, numbers.constructor).set(numbers);
    return at;
  }

  // A generator of random numbers from a list of seeds.
  random(...seed) {
    const at = this.room(48);
    this.random_seed(at, this.put(Uint32Array.from(seed)), seed.length);
    return at;
  }

  // A network of layers of these sizes.
  network(sizes, squared) {
    const at = this.put(Int32Array.from(sizes)), layers = sizes.length - 1, net = this.room(this.network_bytes(at, layers));
    this.network_new(net, at, layers, squared);
    return net;
  }

  // Weights and moments of a network.
  state(net) {
    return this.numbers(this.network_state(net), 3 * this.network_size(net));
  }
}
