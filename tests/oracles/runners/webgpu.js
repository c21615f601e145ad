// Functions of a WGSL file in WebGPU: values of pairs, and their speed.

import { encoded, given } from "/shared.js";

async function device() {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) throw new Error("this browser has no WebGPU adapter");
  const limits = adapter.limits;
  const found = await adapter.requestDevice({
    requiredLimits: {
      maxStorageBufferBindingSize: limits.maxStorageBufferBindingSize,
      maxBufferSize: limits.maxBufferSize,
    },
  });
  found.failed = new Promise((_, reject) => {
    found.onuncapturederror = (event) => reject(new Error(event.error.message));
    found.lost.then((info) => info.reason !== "destroyed" && reject(new Error(info.message)));
  });
  found.failed.catch(() => {}); // it is asked for below
  return found;
}

async function pipeline(gpu, code) {
  const module = gpu.createShaderModule({ code });
  const log = (await module.getCompilationInfo()).messages
    .filter((message) => message.type === "error")
    .map((message) => `line ${message.lineNum}: ${message.message}`);
  if (log.length) throw new Error(log.join("\n"));
  const compute = { module, entryPoint: "main" };
  return gpu.createComputePipelineAsync({ layout: "auto", compute });
}

async function prepared({ code, count, components, group }) {
  const gpu = await device();
  const used = await pipeline(gpu, code);
  const { STORAGE, COPY_SRC, COPY_DST, MAP_READ } = GPUBufferUsage;
  const buffers = [];
  for (const name of ["first", "second"]) {
    const values = await given(name);
    buffers.push(gpu.createBuffer({ size: values.byteLength, usage: STORAGE | COPY_DST }));
    gpu.queue.writeBuffer(buffers.at(-1), 0, values);
  }
  const size = 4 * components * count;
  buffers.push(gpu.createBuffer({ size, usage: STORAGE | COPY_SRC }));
  const entries = buffers.map((buffer, binding) => ({ binding, resource: { buffer } }));
  const layout = used.getBindGroupLayout(0);
  const bound = gpu.createBindGroup({ layout, entries });
  const groups = Math.ceil(count / group);
  const most = gpu.limits.maxComputeWorkgroupsPerDimension;
  const dispatch = () => {
    const commands = gpu.createCommandEncoder();
    const pass = commands.beginComputePass();
    pass.setPipeline(used);
    pass.setBindGroup(0, bound);
    pass.dispatchWorkgroups(Math.min(groups, most), Math.ceil(groups / most));
    pass.end();
    return commands;
  };
  const read = gpu.createBuffer({ size, usage: COPY_DST | MAP_READ });
  return { gpu, dispatch, result: buffers[2], read, size };
}

export async function run(task) {
  const { gpu, dispatch, result, read, size } = await prepared(task);
  const commands = dispatch();
  commands.copyBufferToBuffer(result, 0, read, 0, size);
  gpu.queue.submit([commands.finish()]);
  await Promise.race([read.mapAsync(GPUMapMode.READ), gpu.failed]);
  return encoded(read.getMappedRange());
}

export async function rate(task) {
  const { gpu, dispatch } = await prepared(task);
  const times = [];
  for (let i = 0; i <= task.draws; i++) {
    const start = performance.now();
    gpu.queue.submit([dispatch().finish()]);
    await Promise.race([gpu.queue.onSubmittedWorkDone(), gpu.failed]);
    times.push((performance.now() - start) / 1000);
  }
  return task.count / Math.min(...times.slice(1)); // the first one compiles
}
