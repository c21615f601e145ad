// The arrays for createMaterial(THREE, { textures: await loadTextures(THREE) }): their files are beside this
// module, or in the folder `base` (a URL).
export async function loadTextures(THREE, base = import.meta.url) {
  const found = {};
  for (const [key, { file }] of Object.entries(arrays)) {
    const answer = await fetch(new URL(file, base));
    if (!answer.ok) throw new Error(`${file}: ${answer.status} ${answer.statusText}`);
    found[key] = textureOf(THREE, file, await answer.arrayBuffer());
  }
  return found;
}

// A KTX 2.0 file of half floats with one level, or of bytes with any number of them.
function textureOf(THREE, file, content) {
  const header = new DataView(content);
  const [format, , width, height, , layers, , levels] = Array.from({ length: 8 }, (_, k) =>
    header.getUint32(12 + 4 * k, true),
  );
  const [channels, Numbers] = { 37: [4, Uint8Array], 76: [1, Uint16Array], 97: [4, Uint16Array] }[format] ?? [];
  if (!channels) throw new Error(`${file}: holds neither half floats nor bytes`);
  const mipmaps = Array.from({ length: levels }, (_, k) => {
    const size = [width, height].map((each) => Math.max(each >> k, 1));
    const count = size[0] * size[1] * Math.max(layers, 1) * channels;
    const start = Number(header.getBigUint64(80 + 24 * k, true));
    return { data: new Numbers(content, start, count), width: size[0], height: size[1] };
  });
  const found = layers
    ? new THREE.DataArrayTexture(mipmaps[0].data, width, height, layers)
    : new THREE.DataTexture(mipmaps[0].data, width, height);
  found.format = channels === 4 ? THREE.RGBAFormat : THREE.RedFormat;
  found.type = format === 37 ? THREE.UnsignedByteType : THREE.HalfFloatType;
  found.minFilter = found.magFilter = THREE.LinearFilter;
  if (levels > 1) {
    found.mipmaps = mipmaps;
    found.minFilter = THREE.LinearMipmapLinearFilter;
  }
  found.wrapS = found.wrapT = THREE.RepeatWrapping;
  found.unpackAlignment = 1;
  found.needsUpdate = true;
  return found;
}

