// Numbers on their way into a script and out of it.

export async function given(name) {
  const files = [...document.querySelector("input").files];
  return new Float32Array(await files.find((file) => file.name === name).arrayBuffer());
}

export function encoded(values) {
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(reader.result.slice(reader.result.indexOf(",") + 1));
    reader.onerror = () => reject(new Error("the result cannot be read"));
    reader.readAsDataURL(new Blob([values]));
  });
}
