// Small pictures of materials that come to the page later; nacre packs those of the others.

const SIZE = 96, FRAMES = 32;
const SCENE = { shape: "sphere", turn: [1, 0, 0, 0, 1, 0, 0, 0, 1], surroundings: 1, irradiance: [0, 0, 0], exposure: 1, still: false };

// The sphere in a material {glsl, textures} under the environment that is chosen, as a data: address.
// The renderer is left with this material, and begins anew.
export function thumbnail(renderer, material) {
  const { size } = renderer, scene = { ...renderer.scene };
  try {
    renderer.resize(SIZE, SIZE);
    renderer.change(SCENE);
    renderer.show(material);
    for (let k = 0; k < FRAMES; k++) renderer.frame();
    renderer.present();
    return renderer.canvas.toDataURL("image/jpeg", 0.8);
  } finally {
    renderer.resize(...size);
    renderer.change(scene);
  }
}
