// Boxes in every layout that glTF allows: what the public sample models test, made here.
import fs from "node:fs";
import path from "node:path";
import { PNG } from "pngjs";
import { validate } from "./validate.mjs";
import { check, json, run } from "./process.mjs";

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

/** A PNG of 2 x 2 pixels as a data URI. */
function picture() {
  const png = new PNG({ width: 2, height: 2 });
  png.data.set([255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 0]);
  return `data:image/png;base64,${PNG.sync.write(png).toString("base64")}`;
}

/** Makes the sample's box textured: a material with the picture and texture coordinates. */
function texture(sample, info = {}, material = {}) {
  sample.json.images = [{ uri: picture() }];
  sample.json.samplers = [{ wrapS: 33071, wrapT: 33071 }];
  sample.json.textures = [{ source: 0, sampler: 0 }];
  sample.json.materials = [{ pbrMetallicRoughness: { baseColorTexture: { index: 0, ...info } }, ...material }];
  const view = sample.view(new Float32Array(kCorners.flatMap((c) => [c[0], c[1]])), { target: 34962 });
  const uvs = sample.accessor({ bufferView: view, componentType: 5126, type: "VEC2", count: 8 });
  sample.primitive({ attributes: { POSITION: sample.positions(), TEXCOORD_0: uvs }, indices: sample.indices(), material: 0 });
}

/** Accessor of floats that are no vertices. */
function floats(sample, values, type, more = {}) {
  const sizes = { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 };
  const view = sample.view(new Float32Array(values.flat()));
  return sample.accessor({ bufferView: view, componentType: 5126, type, count: values.flat().length / sizes[type], ...more });
}

/** Adds an animation of one channel of node 0 with the keys 0 and 2 s. At 1 s it must give what the rest state does not. */
function animate(sample, path, type, values, interpolation) {
  const input = floats(sample, [0, 2], "SCALAR", { min: [0], max: [2] });
  const output = floats(sample, values, type);
  sample.json.animations = [{ samplers: [{ input, output, interpolation }], channels: [{ sampler: 0, target: { node: 0, path } }] }];
}

/** Values of a translation's keys that give 0 at 1 s, and elsewhere with another interpolation. */
const kTranslations = {
  LINEAR: [[-1, 0, 0], [1, 0, 0]],
  STEP: [[0, 0, 0], [1, 0, 0]],
  // In-tangent, value and out-tangent of each key; the first and the last tangent have no effect.
  CUBICSPLINE: [[9, 9, 9], [-2, 0, 0], [2, 0, 0], [-2, 0, 0], [0, 0, 0], [9, 9, 9]],
};

/** The box of the vertices times 1/2, so that something has to double them. */
const halved = kCorners.map((c) => c.map((v) => v / 2));
function half(sample) {
  const view = sample.view(new Float32Array(halved.flat()), { target: 34962 });
  return sample.accessor({ bufferView: view, componentType: 5126, type: "VEC3", count: 8, min: [0, 0, 0], max: [0.5, 0.5, 0.5] });
}

/**
 * By name: a function that fills a sample, the number of triangles, options of packtrace, and what becomes of it: a
 * function of the report of `info` and of the texts of the OBJ and MTL files that `export` writes of the baked sample;
 * number of warnings.
 * The box is [0, 1]^3.
 */
const kSamples = {
  bytes: [(s) => s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices(kTriangles, Uint8Array, 5121) }), 12],
  shorts: [(s) => s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices() }), 12],
  words: [(s) => s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices(kTriangles, Uint32Array, 5125) }), 12],
  without_indices: [(s) => {
    const corners = kTriangles.map((i) => kCorners[i]);
    const view = s.view(new Float32Array(corners.flat()), { target: 34962 });
    s.primitive({ attributes: { POSITION: s.accessor({ bufferView: view, componentType: 5126, type: "VEC3", count: 36, min: [0, 0, 0], max: [1, 1, 1] }) } });
  }, 12],
  strip: [(s) => s.primitive({ mode: 5, attributes: { POSITION: s.positions() }, indices: s.indices([2, 3, 6, 7, 4, 3, 0, 2, 1, 6, 5, 4, 1, 0]) }), 12],
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
  hierarchy: [(s) => {
    s.json.nodes = [{ children: [1], scale: [2, 2, 2] }, { children: [2], translation: [0.5, 0, 0] },
      { mesh: 0, matrix: [0, 0.5, 0, 0, -0.5, 0, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1] }];
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices() });
  }, 12],
  mirrored_node: [(s) => {
    s.json.nodes[0] = { mesh: 0, scale: [-1, 1, 1], translation: [1, 0, 0] };
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices() });
  }, 12],
  two_primitives: [(s) => {
    const positions = s.positions();
    s.json.meshes = [{ primitives: [kTriangles.slice(0, 18), kTriangles.slice(18)].map((list) => ({ attributes: { POSITION: positions }, indices: s.indices(list) })) }];
  }, 12],
  two_nodes: [(s) => {
    s.json.nodes = [{ mesh: 0, scale: [0.5, 1, 1] }, { mesh: 0, scale: [0.5, 1, 1], translation: [0.5, 0, 0] }];
    s.json.scenes[0].nodes = [0, 1];
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices() });
  }, 12],
  instances: [(s) => {
    s.json.extensionsUsed = s.json.extensionsRequired = ["EXT_mesh_gpu_instancing"];
    const attributes = { TRANSLATION: floats(s, [[0, 0, 0], [0.5, 0, 0]], "VEC3"), SCALE: floats(s, [[0.5, 1, 1], [0.5, 1, 1]], "VEC3") };
    s.json.nodes[0].extensions = { EXT_mesh_gpu_instancing: { attributes } };
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices() });
  }, 12],
  morph: [(s) => {
    const target = s.view(new Float32Array(halved.flat()), { target: 34962 });
    s.primitive({ attributes: { POSITION: half(s) }, indices: s.indices(),
      targets: [{ POSITION: s.accessor({ bufferView: target, componentType: 5126, type: "VEC3", count: 8, min: [0, 0, 0], max: [0.5, 0.5, 0.5] }) }] });
    s.json.meshes[0].weights = [1];
  }, 12],
  morph_animated: [(s) => {
    kSamples.morph[0](s);
    s.json.meshes[0].weights = [0];
    animate(s, "weights", "SCALAR", [0, 2], "LINEAR");
  }, 12, ["--time", "1"]],
  skin: [(s) => {
    s.json.nodes = [{ mesh: 0, skin: 0 }, { scale: [2, 2, 2] }];
    s.json.scenes[0].nodes = [0, 1];
    s.json.skins = [{ joints: [1], inverseBindMatrices: floats(s, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "MAT4") }];
    const joints = s.view(new Uint8Array(32), { target: 34962, byteStride: 4 });
    const weights = s.view(new Float32Array(kCorners.flatMap(() => [1, 0, 0, 0])), { target: 34962 });
    s.primitive({ attributes: { POSITION: half(s), JOINTS_0: s.accessor({ bufferView: joints, componentType: 5121, type: "VEC4", count: 8 }),
      WEIGHTS_0: s.accessor({ bufferView: weights, componentType: 5126, type: "VEC4", count: 8 }) }, indices: s.indices() });
  }, 12],
  ...Object.fromEntries(Object.entries(kTranslations).map(([interpolation, values]) => [`animation_${interpolation.toLowerCase()}`, [(s) => {
    s.json.nodes[0].translation = [5, 0, 0];
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices() });
    animate(s, "translation", "VEC3", values, interpolation);
  }, 12, ["--time", "1"]]])),
  animation_rotation: [(s) => { // from a turn by -90 degrees to one by 90 degrees around x: both pass 0 on the sphere
    const h = Math.SQRT1_2;
    s.json.nodes[0].rotation = [0, 1, 0, 0];
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices() });
    animate(s, "rotation", "VEC4", [[-h, 0, 0, h], [h, 0, 0, h]], "LINEAR");
  }, 12, ["--time", "1"]],
  animation_scale: [(s) => {
    s.json.nodes[0].scale = [7, 7, 7];
    s.primitive({ attributes: { POSITION: half(s) }, indices: s.indices() });
    animate(s, "scale", "VEC3", [[1, 3, 2], [3, 1, 2]], "LINEAR");
  }, 12, ["--time", "1"]],
  textured: [(s) => texture(s), 12, [], (info, obj, mtl) => info.textures_found === 1 && /^map_Kd -clamp on .*png$/m.test(mtl)],
  texture_transform: [(s) => {
    s.json.extensionsUsed = ["KHR_texture_transform"];
    texture(s, { extensions: { KHR_texture_transform: { offset: [0.25, 0], scale: [2, 2], rotation: 0.5 } } });
  }, 12, [], (info, obj) => { // of the corner (1, 1); v points upwards there
    const c = Math.cos(0.5), sine = Math.sin(0.5), wanted = [2 * c + 2 * sine + 0.25, 1 - (2 * c - 2 * sine)];
    const step = 1 / 32; // of coordinates of an image of 2 x 2 pixels
    return rows(obj, "vt").some((uv) => uv.every((value, k) => Math.abs(value - wanted[k]) < step));
  }],
  textured_mask: [(s) => texture(s, {}, { alphaMode: "MASK", alphaCutoff: 0.25, doubleSided: true }), 12, [],
    (info, obj, mtl) => info.masks === 1 && /^map_d /m.test(mtl) && /^map_Kd /m.test(mtl)],
  ...Object.fromEntries(Object.entries({
    KHR_materials_unlit: [{}, (info) => info.materials_by_kind.matte === 1],
    KHR_materials_emissive_strength: [{ emissiveStrength: 3 }, (info, obj, mtl) => info.area_lights > 0 && /^Ke /m.test(mtl)],
    KHR_materials_transmission: [{ transmissionFactor: 1 }, (info, obj, mtl) => info.materials_by_kind.glass === 1 && /^d /m.test(mtl)],
    // tests/pbrt_import/gltf_test.cpp compares the index of refraction that both give.
    KHR_materials_specular: [{ specularFactor: 0.5 }, (info) => info.materials_by_kind.disney === 1],
    KHR_materials_ior: [{ ior: 1.3 }, (info) => info.materials_by_kind.disney === 1],
  }).map(([extension, [values, expected]]) => [extension.replace("KHR_materials_", ""), [(s) => {
    s.json.extensionsUsed = s.json.extensionsRequired = [extension]; // one that is not known is an error
    s.json.materials = [{ emissiveFactor: extension.endsWith("strength") ? [1, 1, 1] : [0, 0, 0], extensions: { [extension]: values } }];
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices(), material: 0 });
  }, 12, [], expected]])),
  camera_and_lights: [(s) => {
    s.json.extensionsUsed = ["KHR_lights_punctual"];
    s.json.extensions = { KHR_lights_punctual: { lights: ["point", "directional", "spot"].map((type) => ({ type, ...(type === "spot" ? { spot: {} } : {}) })) } };
    s.json.cameras = [{ type: "perspective", perspective: { yfov: 1, znear: 0.1 } }, { type: "orthographic", orthographic: { xmag: 2, ymag: 1, znear: 0, zfar: 10 } }];
    s.json.nodes.push(...[0, 1, 2].map((light) => ({ translation: [0, 3, 0], extensions: { KHR_lights_punctual: { light } } })));
    s.json.nodes.push({ camera: 0, translation: [0, 0, 5] }, { camera: 1, translation: [0, 0, 5] });
    s.json.scenes[0].nodes = s.json.nodes.map((_, i) => i);
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices() });
  }, 12, [], (info) => info.light_sources === 3 && info.camera_list.map((c) => c.projection).join() === "perspective,orthographic"],
  colours_and_tangents: [(s) => {
    const colours = s.view(new Uint8Array(32).fill(200), { target: 34962, byteStride: 4 });
    const normals = s.view(new Float32Array(kCorners.flatMap(() => [0, 0, 1])), { target: 34962 });
    const tangents = s.view(new Float32Array(kCorners.flatMap(() => [1, 0, 0, 1])), { target: 34962 });
    s.primitive({ attributes: { POSITION: s.positions(),
      COLOR_0: s.accessor({ bufferView: colours, componentType: 5121, normalized: true, type: "VEC4", count: 8 }),
      NORMAL: s.accessor({ bufferView: normals, componentType: 5126, type: "VEC3", count: 8 }),
      TANGENT: s.accessor({ bufferView: tangents, componentType: 5126, type: "VEC4", count: 8 }) }, indices: s.indices() });
  }, 12, [], undefined, 1], // colours are left out
  names: [(s) => {
    s.json.nodes[0].name = "Würfel\u0000\"\\ \ud83d\ude00";
    s.json.materials = [{ name: "" }, { name: "" }];
    s.primitive({ attributes: { POSITION: s.positions() }, indices: s.indices(), material: 1 });
  }, 12],
  // Alpha 0.2 is a surface, one above or below the cutoff, or glass; a second box shows the first one's absence.
  ...Object.fromEntries(Object.entries({
    opaque: [{}, opaque],
    mask: [{ alphaMode: "MASK", alphaCutoff: 0.15 }, opaque],
    mask_absent: [{ alphaMode: "MASK", alphaCutoff: 0.25 }, (info, obj, mtl) => info.shapes_absent === 1 && !/^Kd 1 0\.5 0$/m.test(mtl)],
    blend: [{ alphaMode: "BLEND" }, (info, obj, mtl) => info.materials_by_kind.glass === 1 && /^d /m.test(mtl)],
  }).map(([name, [mode, expected]]) => [`alpha_${name}`, [(s) => {
    s.json.materials = [{ ...mode, pbrMetallicRoughness: { baseColorFactor: [1, 0.5, 0, 0.2] } }, { pbrMetallicRoughness: { baseColorFactor: [0, 0, 1, 1] } }];
    const attributes = { POSITION: s.positions() }, indices = s.indices();
    s.json.meshes = [{ primitives: (name === "mask_absent" ? [0, 1] : [0]).map((material) => ({ attributes, indices, material })) }];
  }, 12, [], expected]])),
};

function opaque(info, obj, mtl) {
  return info.materials_by_kind.disney > 0 && info.shapes_absent === 0 && /^Kd 1 0\.5 0$/m.test(mtl) && !/^d /m.test(mtl);
}

/** The numbers of the lines of an OBJ file with a keyword. */
const rows = (text, keyword) => [...text.matchAll(new RegExp(`^${keyword} (.*)$`, "gm"))].map((line) => line[1].split(" ").map(Number));

/** Volume that the faces of an OBJ file enclose; negative if they face inwards. */
function volume(obj) {
  const positions = rows(obj, "v");
  let sixfold = 0;
  for (const [, corners] of obj.matchAll(/^f (.*)$/gm)) {
    const [a, b, c] = corners.split(" ").map((corner) => positions[parseInt(corner) - 1]);
    sixfold += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sixfold / 6;
}

export async function readSamples(packtrace, work) {
  for (const [name, [fill, triangles, options = [], expected, warnings = 0]] of Object.entries(kSamples)) {
    const sample = new Sample(), at = (ending) => path.join(work, `box_${name}.${ending}`), file = at("gltf");
    fill(sample);
    sample.write(file);
    await validate(file, `box ${name}`);
    const info = json(packtrace, "info", file, ...options);
    check(info.triangles === triangles, `box ${name} has its triangles`, `${info.triangles} instead of ${triangles}`);
    const { errors, warnings: found } = info.problems;
    check(errors === 0 && found === warnings, `box ${name} is read with ${warnings} warnings`, `${errors} errors, ${found} warnings`);
    const bounds = JSON.stringify(info.bounds), lo = [-1, 0, 0], hi = [0, 1, 1]; // x is mirrored
    if (info.animated.begin_s === null) // bounds of what moves hold at all times
      check(info.bounds.hi.every((v, i) => Math.abs(v - hi[i]) < 1e-5) && info.bounds.lo.every((v, i) => Math.abs(v - lo[i]) < 1e-5),
            `box ${name} is where it should be`, `${bounds} instead of ${JSON.stringify({ hi, lo })}`);
    run(packtrace, "bake", file, "-o", at("ptk"), "--for", "shading", "--lod", "off", "--force", "-q", ...options);
    run(packtrace, "export", at("ptk"), "-o", at("obj"), "--force", "-q");
    const obj = fs.readFileSync(at("obj"), "utf8"), enclosed = volume(obj);
    const corners = rows(obj, "v"); // at --time
    for (const k of [0, 1, 2])
      check([Math.min, Math.max].every((of, bound) => Math.abs(of(...corners.map((v) => v[k])) - bound) < 1e-3),
            `box ${name} is unpacked where it should be`, `axis ${k}`);
    if (triangles === 12) check(Math.abs(enclosed - 1) < 1e-3, `the faces of box ${name} look outwards`, `they enclose ${enclosed}`);
    if (expected) check(expected(info, obj, fs.readFileSync(at("mtl"), "utf8")), `box ${name} keeps its materials, lights and cameras`);
  }
}
