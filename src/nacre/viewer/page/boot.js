// Unpacks the page's script, gzipped as base64 in an element, and runs it; the policy has its hash.

const packed = Uint8Array.from(atob(document.getElementById("code").textContent), (c) => c.charCodeAt(0));
const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
new Response(stream).text().then((text) => {
  const script = document.createElement("script");
  script.type = "module";
  script.textContent = text;
  document.body.append(script);
});
