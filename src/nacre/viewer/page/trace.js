// Operations of formulas, as nacre.compile.trace writes them down: each once, without what cannot change
// a value. An operation is [name, ...], with values by their numbers.

export const constant = ([name, value]) => (name === "number" ? value : name === "literal" ? Number(value) : NaN);

class Trace {
  operations = [];
  known = new Map();

  add(...operation) {
    const key = operation.map((part) => (Object.is(part, -0) ? "-0" : part)).join(" ");
    if (!this.known.has(key)) {
      this.known.set(key, this.operations.length);
      this.operations.push(operation);
    }
    return this.known.get(key);
  }

  number(value) {
    return this.add("number", Math.fround(value));
  }

  // A sum, difference, product or quotient.
  arithmetic(name, a, b) {
    const left = constant(this.operations[a]), right = constant(this.operations[b]);
    if ((name === "mul" && left === 1) || (name === "add" && left === 0)) return b;
    if (((name === "mul" || name === "div") && right === 1) || ((name === "add" || name === "sub") && right === 0)) return a;
    if (name === "mul" && (left === 0 || right === 0)) return left === 0 ? a : b;
    return this.add(name, a, b);
  }

  // Recorded operations from number `start` up to `end`. `found` has the numbers of their values here, by
  // their numbers there, and is added to; `datum` gives the number of an open one.
  replay(operations, found, datum, start = 0, end = operations.length) {
    for (let k = start; k < end; k++) {
      const [name, ...parts] = operations[k], [a, b, c] = parts.map((part) => found[part]);
      if (name === "input" || name === "literal") found[k] = this.add(name, parts[0]);
      else if (name === "number") found[k] = this.number(parts[0]);
      else if (name === "datum") found[k] = this.number(datum(parts[0]));
      else if (["add", "sub", "mul", "div"].includes(name)) found[k] = this.arithmetic(name, a, b);
      else if (name === "where" && b === c) found[k] = b;
      else found[k] = this.add(name, ...[a, b, c].slice(0, parts.length));
    }
    return found;
  }

  // A layer {weights (inputs x rows), biases} on values; returns its sums.
  layer(values, layer) {
    const count = layer.biases.length, number = this.operations.push(["dense", layer, values]) - 1;
    return Array.from({ length: count }, (_, row) => this.add("output", number, row));
  }
}

// The formula of a network: recorded with one unit between inputs and outputs, and traced with all.
export function traced(recorded, layers, squared, datum) {
  const trace = new Trace(), { operations } = recorded, found = [];
  const places = operations.flatMap(([name], k) => (name === "dense" ? [k] : []));
  trace.replay(operations, found, datum, 0, places[0]);
  let values = operations[places[0]][4].map((number) => found[number]);
  layers.forEach((layer, k) => {
    values = trace.layer(values, layer);
    if (k < layers.length - 1)
      values = values.map((value) => {
        const positive = trace.add("max", value, trace.number(0));
        return squared ? trace.arithmetic("mul", positive, value) : positive;
      });
  });
  // What stands between the layers are numbers, which later operations may use as well.
  operations.slice(places[0], places[1]).forEach(([name, value], k) => {
    if (name === "number") found[places[0] + k] = trace.number(value);
  });
  values.forEach((value, k) => (found[places[1] + 1 + k] = value));
  trace.replay(operations, found, datum, places[1] + 1 + values.length);
  return formula(trace, recorded, found);
}

export function replayed(recorded, datum) {
  const trace = new Trace();
  return formula(trace, recorded, trace.replay(recorded.operations, [], datum));
}

// {operations, results}, of which the results are lists of values.
const formula = ({ operations }, { results }, found) => ({ operations, results: results.map((result) => result.map((number) => found[number])) });
