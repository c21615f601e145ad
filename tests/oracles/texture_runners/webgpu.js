// An exported texture in WebGPU: values at points, and how long they take.

import { encoded, given } from "/shared.js";

async function device() {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) throw new Error("this browser has no WebGPU adapter");
  const found = await adapter.requestDevice();
  found.failed = new Promise((_, reject) => {
    found.onuncapturederror = (event) => reject(new Error(event.error.message));
    found.lost.then((info) => info.reason !== "destroyed" && reject(new Error(info.message)));
  });
  found.failed.catch(() => {}); // it is asked for below
  return found;
}

async function texture(gpu, name, { width, height, layers, channels }) {
  const size = [width, height, layers || 1];
  const format = channels === 4 ? "rgba16float" : "r16float";
  const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
  const made = gpu.createTexture({ size, format, usage });
  const layout = { bytesPerRow: 2 * width * channels, rowsPerImage: height };
  const bytes = new Uint8Array((await given(name)).buffer, 0, layout.bytesPerRow * height * size[2]);
  gpu.queue.writeTexture({ texture: made }, bytes, layout, size);
  return made.createView({ dimension: layers ? "2d-array" : "2d" });
}

async function prepared({ code, count, group, textures }) {
  const gpu = await device();
  const module = gpu.createShaderModule({ code });
  const { STORAGE, COPY_SRC, COPY_DST, MAP_READ } = GPUBufferUsage;
  const visibility = GPUShaderStage.COMPUTE;
  const points = await given("points");
  const inputs = gpu.createBuffer({ size: points.byteLength, usage: STORAGE | COPY_DST });
  gpu.queue.writeBuffer(inputs, 0, points);
  const results = gpu.createBuffer({ size: 16 * count, usage: STORAGE | COPY_SRC });
  const sampler = gpu.createSampler({
    magFilter: "linear",
    minFilter: "linear",
    addressModeU: "repeat",
    addressModeV: "repeat",
  });
  const entries = [
    ["read-only-storage", "storage"].map((type) => ({ buffer: { type } })),
    [
      { sampler: { type: "filtering" } },
      ...Object.values(textures).map(({ layers }) => ({
        texture: { viewDimension: layers ? "2d-array" : "2d" },
      })),
    ],
  ];
  const layouts = entries.map((group) =>
    gpu.createBindGroupLayout({ entries: group.map((of, binding) => ({ binding, visibility, ...of })) }),
  );
  const views = [];
  for (const [name, of] of Object.entries(textures)) views.push(await texture(gpu, name, of));
  const bound = [[{ buffer: inputs }, { buffer: results }], [sampler, ...views]].map((group, index) =>
    gpu.createBindGroup({
      layout: layouts[index],
      entries: group.map((resource, binding) => ({ binding, resource })),
    }),
  );
  const used = await gpu.createComputePipelineAsync({
    layout: gpu.createPipelineLayout({ bindGroupLayouts: layouts }),
    compute: { module, entryPoint: "compute_all" },
  });
  const read = gpu.createBuffer({ size: 16 * count, usage: COPY_DST | MAP_READ });
  const execute = async () => {
    const commands = gpu.createCommandEncoder();
    const pass = commands.beginComputePass();
    pass.setPipeline(used);
    bound.forEach((group, index) => pass.setBindGroup(index, group));
    pass.dispatchWorkgroups(Math.ceil(count / group));
    pass.end();
    commands.copyBufferToBuffer(results, 0, read, 0, 16 * count);
    gpu.queue.submit([commands.finish()]);
    await Promise.race([gpu.queue.onSubmittedWorkDone(), gpu.failed]);
  };
  return { gpu, execute, read };
}

export async function run(task) {
  const { gpu, execute, read } = await prepared(task);
  await execute();
  await Promise.race([read.mapAsync(GPUMapMode.READ), gpu.failed]);
  return encoded(read.getMappedRange());
}

export async function seconds(task) {
  const { execute } = await prepared(task);
  const times = [];
  for (let draw = 0; draw <= task.draws; draw++) {
    const start = performance.now();
    await execute();
    times.push((performance.now() - start) / 1000);
  }
  return Math.min(...times.slice(1)); // the first one compiles
}
