// Boxes in every layout that glTF allows: what the public sample models test, made here.
import fs from "node:fs";
import path from "node:path";
import { validate } from "./validate.mjs";
import { check, json } from "./process.mjs";

const kCorners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
const kTriangles = [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 3, 6, 2, 3, 7, 6, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5];

class Sample {
  json = { asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], bufferViews: [], accessors: [] };
  chunks = [];
  size = 0;

  view(typed, more = {}) {
    while (this.size % 4 !== 0) this.append(Buffer.alloc(1));
    this.json.bufferViews.push({ buffer: 0, byteOffset: this.size, byteLength: typed.byteLength, ...more });
    this.append(Buffer.from(typed.buffer, typed.byteOffset, typed.byteLength));
    return this.json.bufferViews.length - 1;
  }
  append(bytes) {
    this.chunks.push(bytes);
    this.size += bytes.length;
  }
  accessor(fields) {
    this.json.accessors.push(fields);
    return this.json.accessors.length - 1;
  }
  positions(more = {}) {
    const view = this.view(new Float32Array(kCorners.flat()), { target: 34962 });
    return this.accessor({ bufferView: view, componentType: 5126, type: "VEC3", count: 8, min: [0, 0, 0], max: [1, 1, 1], ...more });
  }
  indices(list = kTriangles, Type = Uint16Array, componentType = 5123) {
    const view = this.view(new Type(list), { target: 34963 });
    return this.accessor({ bufferView: view, componentType, type: "SCALAR", count: list.length });
  }
  primitive(fields) {
    this.json.meshes = [{ primitives: [fields] }];
  }
  write(file) {
    const buffer = Buffer.concat(this.chunks);
    this.json.buffers = [{ byteLength: buffer.length, uri: `data:application/octet-stream;base64,${buffer.toString("base64")}` }];
    fs.writeFileSync(file, JSON.stringify(this.json));
  }
}

/** By name: a function that fills a sample, and the number of triangles. */
const kSamples = {
  bytes: [(s) => s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices(kTriangles, Uint8Array, 5121) }), 12],
  shorts: [(s) => s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices() }), 12],
  words: [(s) => s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices(kTriangles, Uint32Array, 5125) }), 12],
  without_indices: [(s) => {
    const corners = kTriangles.map((i) => kCorners[i]);
    const view = s.view(new Float32Array(corners.flat()), { target: 34962 });
    s.primitive({ attributes: { POSITION: s.accessor({ bufferView: view, componentType: 5126, type: "VEC3", count: 36, min: [0, 0, 0], max: [1, 1, 1] }) } });
  }, 12],
  strip: [(s) => s.primitive({ mode: 5, attributes: { POSITION: s.positions() }, indices: s.indices([3, 2, 7, 6, 5, 2, 1, 3, 0, 7, 4, 5, 0, 1]) }), 12],
  fan: [(s) => s.primitive({ mode: 6, attributes: { POSITION: s.positions() }, indices: s.indices([0, 1, 2, 6, 7, 4, 5]) }), 5],
  interleaved: [(s) => {
    const values = new Float32Array(kCorners.flatMap((c) => [...c, ...c.map((v) => (v - 0.5) * 2 / Math.sqrt(3))]));
    const view = s.view(values, { target: 34962, byteStride: 24 });
    const accessor = (byteOffset, more) => s.accessor({ bufferView: view, byteOffset, componentType: 5126, type: "VEC3", count: 8, ...more });
    s.primitive({ attributes: { POSITION: accessor(0, { min: [0, 0, 0], max: [1, 1, 1] }), NORMAL: accessor(12, {}) }, indices: s.indices() });
  }, 12],
  sparse: [(s) => {
    const flat = kCorners.map((c) => [c[0], c[1], 0]);
    const view = s.view(new Float32Array(flat.flat()), { target: 34962 });
    const indices = s.view(new Uint8Array([4, 5, 6, 7])), values = s.view(new Float32Array(kCorners.slice(4).flat()));
    s.primitive({ attributes: { POSITION: s.accessor({ bufferView: view, componentType: 5126, type: "VEC3", count: 8, min: [0, 0, 0], max: [1, 1, 1],
      sparse: { count: 4, indices: { bufferView: indices, componentType: 5121 }, values: { bufferView: values } } }) }, indices: s.indices() });
  }, 12],
  sparse_without_view: [(s) => {
    const indices = s.view(new Uint8Array([1, 2, 3, 4, 5, 6, 7])), values = s.view(new Float32Array(kCorners.slice(1).flat()));
    s.primitive({ attributes: { POSITION: s.accessor({ componentType: 5126, type: "VEC3", count: 8, min: [0, 0, 0], max: [1, 1, 1],
      sparse: { count: 7, indices: { bufferView: indices, componentType: 5121 }, values: { bufferView: values } } }) }, indices: s.indices() });
  }, 12],
  quantized: [(s) => {
    s.json.extensionsUsed = s.json.extensionsRequired = ["KHR_mesh_quantization"];
    const view = s.view(new Int16Array(kCorners.flatMap((c) => [...c.map((v) => v * 1000), 0])), { target: 34962, byteStride: 8 });
    s.json.nodes[0].scale = [0.001, 0.001, 0.001];
    s.primitive({ attributes: { POSITION: s.accessor({ bufferView: view, componentType: 5122, type: "VEC3", count: 8, min: [0, 0, 0], max: [1000, 1000, 1000] }) }, indices: s.indices() });
  }, 12],
  normalized: [(s) => {
    s.json.extensionsUsed = s.json.extensionsRequired = ["KHR_mesh_quantization"];
    const view = s.view(new Uint8Array(kCorners.flatMap((c) => [...c.map((v) => v * 255), 0])), { target: 34962, byteStride: 4 });
    s.primitive({ attributes: { POSITION: s.accessor({ bufferView: view, componentType: 5121, normalized: true, type: "VEC3", count: 8, min: [0, 0, 0], max: [255, 255, 255] }) }, indices: s.indices() });
  }, 12],
  ...Object.fromEntries(["OPAQUE", "MASK", "BLEND"].map((alphaMode) => [`alpha_${alphaMode.toLowerCase()}`, [(s) => {
    s.json.materials = [{ alphaMode, ...(alphaMode === "MASK" ? { alphaCutoff: 0.25 } : {}), pbrMetallicRoughness: { baseColorFactor: [1, 0.5, 0, 0.75] } }];
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices(), material: 0 });
  }, 12]])),
};

export async function readSamples(packtrace, work) {
  for (const [name, [fill, triangles]] of Object.entries(kSamples)) {
    const sample = new Sample(), file = path.join(work, `box_${name}.gltf`);
    fill(sample);
    sample.write(file);
    await validate(file, `box ${name}`);
    const info = json(packtrace, "info", file);
    check(info.triangles === triangles, `box ${name} has its triangles`, `${info.triangles} instead of ${triangles}`);
    check(info.problems.errors + info.problems.warnings === 0, `box ${name} is read without problems`);
    const bounds = JSON.stringify(info.bounds), expected = JSON.stringify({ hi: [0, 1, 1], lo: [-1, 0, 0] });
    check(info.bounds.hi.every((v, i) => Math.abs(v - [0, 1, 1][i]) < 1e-5) && info.bounds.lo.every((v, i) => Math.abs(v - [-1, 0, 0][i]) < 1e-5),
          `box ${name} is where it should be`, `${bounds} instead of ${expected}`);
  }
}
