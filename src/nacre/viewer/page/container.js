// What the page carries: JSON and bytes, gzipped, as base64 in an element that nothing runs.

// {facts, bytes(name)} of the element's text.
export function unpacked(text) {
  return opened(Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0)));
}

// The same of the gzipped bytes.
export async function opened(packed) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const all = new Uint8Array(await new Response(stream).arrayBuffer());
  const length = new DataView(all.buffer).getUint32(0, true);
  const facts = JSON.parse(new TextDecoder().decode(all.subarray(4, 4 + length)));
  const bytes = (name) => {
    const [start, size] = facts.parts[name];
    return all.slice(4 + length + start, 4 + length + start + size);
  };
  return { facts, bytes };
}
