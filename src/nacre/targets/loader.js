// The arrays for createMaterial(THREE, { textures: await loadTextures(THREE) }): their files are beside this
// module, or in the folder `base` (a URL).
export async function loadTextures(THREE, base = import.meta.url) {
  const found = {};
  for (const [key, { file }] of Object.entries(arrays)) {
    const answer = await fetch(new URL(file, base));
    if (!answer.ok) throw new Error(`${file}: ${answer.status} ${answer.statusText}`);
    found[key] = halfFloats(THREE, file, await answer.arrayBuffer());
  }
  return found;
}

// A KTX 2.0 file of half floats with one level.
function halfFloats(THREE, file, content) {
  const header = new DataView(content);
  const [format, , width, height, , layers] = Array.from({ length: 6 }, (_, k) =>
    header.getUint32(12 + 4 * k, true),
  );
  const channels = { 76: 1, 97: 4 }[format];
  if (!channels) throw new Error(`${file}: holds no half floats`);
  const start = Number(header.getBigUint64(80, true));
  const values = new Uint16Array(content, start, width * height * Math.max(layers, 1) * channels);
  const texture = layers
    ? new THREE.DataArrayTexture(values, width, height, layers)
    : new THREE.DataTexture(values, width, height);
  texture.format = channels === 4 ? THREE.RGBAFormat : THREE.RedFormat;
  texture.type = THREE.HalfFloatType;
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

