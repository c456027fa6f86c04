// Sizes and measured errors of glTF files that packtrace, gltfpack and glTF-Transform make of a scene.
// Usage: node sizes.mjs PACKTRACE WORK SCENE.pbrt [BITS]
//   BITS  of positions over the whole scene: gltfpack's -vp (default 16); packtrace bakes with the largest step that has its position error
// All begin with one portable file of a fine lattice, and errors are those against it. The exit code is 1 if a file lacks
// more than 0.1 % of its vertices, since its errors are then not those of the whole.
import fs from "node:fs";
import path from "node:path";
import { NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import { MeshoptDecoder } from "meshoptimizer";
import draco3d from "draco3dgltf";
import sharp from "sharp";
import { bytesOf, check, json, run, summary, tool } from "./process.mjs";

const multiply = (a, b) => {
  const out = new Array(16).fill(0);
  for (let c = 0; c < 4; ++c) for (let r = 0; r < 4; ++r) for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
};
function compose(t, q, s) {
  const [x, y, z, w] = q;
  return [(1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y + z * w) * s[0], 2 * (x * z - y * w) * s[0], 0,
    2 * (x * y - z * w) * s[1], (1 - 2 * (x * x + z * z)) * s[1], 2 * (y * z + x * w) * s[1], 0,
    2 * (x * z + y * w) * s[2], 2 * (y * z - x * w) * s[2], (1 - 2 * (x * x + y * y)) * s[2], 0, ...t, 1];
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Unit normals by the inverse transpose of a map, which may mirror. */
function turned(m, n) {
  const x = m.slice(0, 3), y = m.slice(4, 7), z = m.slice(8, 11), yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
  const sign = Math.sign(dot(x, yz));
  const v = [0, 1, 2].map((k) => sign * (n[0] * yz[k] + n[1] * zx[k] + n[2] * xy[k]));
  const length = Math.hypot(...v);
  return v.map((c) => c / length);
}

/** Corners of the triangles of a primitive, three by three. */
function corners(primitive) {
  const indices = primitive.getIndices(), count = (indices ?? primitive.getAttribute("POSITION")).getCount();
  const at = (i) => (indices ? indices.getScalar(i) : i);
  if (primitive.getMode() === 4) return Array.from({ length: count }, (_, i) => at(i));
  if (primitive.getMode() !== 5) throw new Error(`primitives of mode ${primitive.getMode()} are not measured`);
  const strip = [];
  for (let i = 0; i + 2 < count; ++i) strip.push(at(i), at(i + 1 + (i & 1)), at(i + 2 - (i & 1)));
  return strip;
}

/** Unit normal of a triangle times a sign, zero without area, and its smallest height; p holds x, y, z of each vertex. */
function face(p, a, b, c, sign) {
  const [u, v, w] = [[a, b], [a, c], [b, c]].map(([i, j]) => [0, 1, 2].map((k) => p[3 * j + k] - p[3 * i + k]));
  const n = cross(u, v), twice = Math.hypot(...n);
  return twice > 0 ? { normal: n.map((x) => (sign * x) / twice), height: twice / Math.max(...[u, v, w].map((e) => Math.hypot(...e))) } : { normal: n, height: 0 };
}

/**
 * Vertices in the world: positions, normals, and the largest of their triangles' smallest heights, 0 without triangles.
 * Primitives without normals have zeros; with `faces` they have a vertex per corner with the triangle's normal, as glTF says.
 */
async function vertices(file, faces) {
  const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
    "meshopt.decoder": MeshoptDecoder, "draco3d.decoder": await draco3d.createDecoderModule(),
  });
  await MeshoptDecoder.ready;
  const document = await io.read(file), positions = [], normals = [], heights = [];
  const add = (primitive, map) => {
    const p = primitive.getAttribute("POSITION"), n = primitive.getAttribute("NORMAL"), v = [], placed = [];
    const sign = Math.sign(dot(cross(map.slice(0, 3), map.slice(4, 7)), map.slice(8, 11))); // maps that mirror turn the triangles' winding
    for (let i = 0; i < p.getCount(); ++i) {
      p.getElement(i, v);
      for (let k = 0; k < 3; ++k) placed.push(map[k] * v[0] + map[4 + k] * v[1] + map[8 + k] * v[2] + map[12 + k]);
    }
    const t = corners(primitive), high = new Array(p.getCount()).fill(0);
    for (let i = 0; i < t.length; i += 3) {
      const { normal, height } = face(placed, t[i], t[i + 1], t[i + 2], sign);
      for (let k = i; k < i + 3; ++k) {
        high[t[k]] = Math.max(high[t[k]], height);
        if (!n && faces) positions.push(...placed.slice(3 * t[k], 3 * t[k] + 3)), normals.push(...normal), heights.push(height);
      }
    }
    for (let i = 0; (n || !faces) && i < p.getCount(); ++i)
      positions.push(...placed.slice(3 * i, 3 * i + 3)), normals.push(...(n ? turned(map, n.getElement(i, v)) : [0, 0, 0])), heights.push(high[i]);
  };
  const visit = (node, parent) => {
    const world = multiply(parent, node.getMatrix());
    const maps = [], batch = node.getExtension("EXT_mesh_gpu_instancing");
    if (batch) {
      const [t, r, s] = ["TRANSLATION", "ROTATION", "SCALE"].map((name) => batch.getAttribute(name));
      for (let i = 0; i < (t ?? r ?? s).getCount(); ++i)
        maps.push(multiply(world, compose(t?.getElement(i, []) ?? [0, 0, 0], r?.getElement(i, []) ?? [0, 0, 0, 1], s?.getElement(i, []) ?? [1, 1, 1])));
    } else {
      maps.push(world);
    }
    for (const primitive of node.getMesh()?.listPrimitives() ?? []) for (const map of maps) add(primitive, map);
    for (const child of node.listChildren()) visit(child, world);
  };
  for (const node of document.getRoot().listScenes()[0].listChildren()) visit(node, compose([0, 0, 0], [0, 0, 0, 1], [1, 1, 1]));
  return { positions: Float64Array.from(positions), normals: Float32Array.from(normals), heights: Float32Array.from(heights) };
}

/**
 * Errors of a sample of vertices against the nearest one of the same scene in another file. Angles count where a
 * triangle keeps its area on every lattice of the step: points move by at most sqrt(3)/2 steps, so triangles that are
 * not higher than sqrt(3) steps can collapse to a line. Files may leave those out, and with them their normals, which
 * nobody sees; the angles of vertices that have no other triangle count apart.
 */
function errors(reference, test, step, reach, samples = 200000) {
  const count = test.positions.length / 3, size = 1 << 22, heads = new Int32Array(size).fill(-1), next = new Int32Array(count);
  const cell = (v) => Math.floor(v / reach);
  const hash = (x, y, z) => ((Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791)) >>> 0) & (size - 1);
  for (let i = 0; i < count; ++i) {
    const h = hash(...[0, 1, 2].map((k) => cell(test.positions[3 * i + k])));
    next[i] = heads[h], heads[h] = i;
  }
  const all = reference.positions.length / 3, stride = Math.max(1, Math.floor(all / samples));
  let squares = 0, largest = 0, sampled = 0, lost = 0;
  const tall = { squares: 0, largest: 0, count: 0, far: 0 }, low = { ...tall };
  for (let i = 0; i < all; i += stride) {
    const p = reference.positions.subarray(3 * i, 3 * i + 3), n = reference.normals.subarray(3 * i, 3 * i + 3);
    const near = [];
    let least = Infinity;
    for (let x = -1; x <= 1; ++x) for (let y = -1; y <= 1; ++y) for (let z = -1; z <= 1; ++z)
      for (let k = heads[hash(cell(p[0]) + x, cell(p[1]) + y, cell(p[2]) + z)]; k >= 0; k = next[k]) {
        const distance = Math.hypot(test.positions[3 * k] - p[0], test.positions[3 * k + 1] - p[1], test.positions[3 * k + 2] - p[2]);
        if (distance <= reach) near.push([distance, k]);
        least = Math.min(least, distance);
      }
    ++sampled;
    if (!(least <= reach)) { ++lost; continue; }
    squares += least * least, largest = Math.max(largest, least);
    if (n[0] === 0 && n[1] === 0 && n[2] === 0) continue;
    let angle = Infinity; // of the best normal at that place: vertices at creases have several
    for (const [distance, k] of near)
      if (distance <= least + 0.25 * reach) {
        const m = test.normals.subarray(3 * k, 3 * k + 3);
        if (dot(m, m) > 0) angle = Math.min(angle, Math.atan2(Math.hypot(...cross(n, m)), dot(n, m)));
      }
    if (angle === Infinity) angle = Math.PI; // only triangles without area are there
    const group = reference.heights[i] > Math.sqrt(3) * step ? tall : low;
    group.squares += angle * angle, group.largest = Math.max(group.largest, angle), ++group.count, group.far += angle > 0.05;
  }
  const degrees = 180 / Math.PI, rms = ({ squares: sum, count: of }) => (of > 0 ? degrees * Math.sqrt(sum / of) : 0);
  return { position_rms: Math.sqrt(squares / (sampled - lost)), position_max: largest, lost: lost / sampled, low: low.count / sampled,
    normal_rms: rms(tall), normal_max: degrees * tall.largest, low_rms: rms(low), low_far: low.far / sampled };
}

/** Pixels of the images of a .glb file: 4 bytes each. */
async function images(file) {
  const bytes = fs.readFileSync(file), length = bytes.readUInt32LE(12), gltf = JSON.parse(bytes.subarray(20, 20 + length));
  return Promise.all((gltf.images ?? []).map((image) => {
    const view = gltf.bufferViews[image.bufferView], begin = 28 + length + (view.byteOffset ?? 0);
    return sharp(bytes.subarray(begin, begin + view.byteLength)).ensureAlpha().raw().toBuffer({ resolveWithObject: true });
  }));
}

/**
 * PSNR in dB of the colours of all images that are not transparent, taken together; each is compared with the most
 * similar one of its size. Undefined without images, or if one has no counterpart.
 */
async function imagePsnr(reference, file) {
  const [wanted, found] = [await images(reference), await images(file)];
  let squares = 0, values = 0;
  for (const a of wanted) {
    let least = Infinity, count = 0;
    for (const b of found.filter((one) => one.info.width === a.info.width && one.info.height === a.info.height)) {
      let sum = 0, visible = 0;
      for (let i = 0; i < a.data.length; i += 4) {
        if (a.data[i + 3] === 0) continue;
        for (let c = 0; c < 3; ++c) sum += (a.data[i + c] - b.data[i + c]) ** 2;
        visible += 3;
      }
      if (sum < least) least = sum, count = visible;
    }
    if (least === Infinity) return undefined;
    squares += least, values += count;
  }
  return values > 0 ? 10 * Math.log10(255 ** 2 * values / squares) : undefined;
}

/** Bytes of a file by what they hold: compressed views by their use, images, JSON and the rest. */
function streams(file) {
  const bytes = fs.readFileSync(file), length = bytes.readUInt32LE(12), gltf = JSON.parse(bytes.subarray(20, 20 + length));
  const uses = {}, of = {};
  for (const mesh of gltf.meshes ?? [])
    for (const primitive of mesh.primitives) {
      for (const [name, accessor] of Object.entries(primitive.attributes)) uses[gltf.accessors[accessor].bufferView] ??= name;
      if (primitive.indices !== undefined) uses[gltf.accessors[primitive.indices].bufferView] ??= "indices";
      const draco = primitive.extensions?.KHR_draco_mesh_compression;
      if (draco) uses[draco.bufferView] = "Draco";
    }
  for (const image of gltf.images ?? []) uses[image.bufferView] = "images";
  for (const [i, view] of (gltf.bufferViews ?? []).entries()) {
    const use = uses[i] ?? "other", coded = view.extensions?.EXT_meshopt_compression ?? view;
    of[use] = (of[use] ?? 0) + coded.byteLength;
  }
  return { ...of, JSON: length };
}

const [packtrace, work, scene, bits = "16"] = process.argv.slice(2);
const name = path.basename(scene, ".pbrt"), at = (ending) => path.join(work, `${name}.${ending}`);
fs.mkdirSync(work, { recursive: true });
const bake = ["--for", "shading", "--lod", "off", "--force", "-q"];
run(packtrace, "bake", scene, "-o", at("fine.ptk"), ...bake);
const { hi, lo } = json(packtrace, "info", at("fine.ptk")).bounds;
const step = Math.max(...hi.map((v, k) => v - lo[k])) / (2 ** Number(bits) - 1);
run(packtrace, "bake", scene, "-o", at("fine.ptk"), "--grid-step-abs", String(step / 16), ...bake);
run(packtrace, "export", at("fine.ptk"), "-o", at("portable.glb"), "--profile", "portable", "--force", "-q");
run(tool("gltfpack"), "-i", at("portable.glb"), "-o", at("gltfpack.glb"), "-cc", "-mi", "-vp", bits);
for (const codec of ["meshopt", "draco"])
  run(tool("gltf-transform"), "optimize", at("portable.glb"), at(`transform_${codec}.glb`), "--compress", codec, "--texture-compress", "webp", "--simplify", "false");
const reference = await vertices(at("portable.glb"), false), reach = 4 * step;
const kMaxLost = 0.001, kMaxAngle = 3; // degrees: what bakes of coarse lattices allow, with 8 bits of the codec
const measure = async (ending) => {
  const test = await vertices(at(ending), true), near = errors(reference, test, step, reach);
  return near.lost < kMaxLost ? near : errors(reference, test, step, 16 * reach, 2000); // instances may be further away
};
const measured = { gltfpack: await measure("gltfpack.glb") };
let own = step; // the largest step with gltfpack's position error
for (let round = 0; round < 4; ++round) {
  run(packtrace, "bake", scene, "-o", at("ptk"), "--grid-step-abs", String(own), ...bake);
  run(packtrace, "export", at("ptk"), "-o", at("web.glb"), "--profile", "web", "--force", "-q");
  measured.web = await measure("web.glb");
  const ratio = measured.gltfpack.position_rms / measured.web.position_rms;
  if (ratio > 0.995) break;
  own *= 0.99 * ratio;
}
// Where images are compared too: the profile with images as good as glTF-Transform's, which are lossy as well.
const theirs = await imagePsnr(at("portable.glb"), at("transform_meshopt.glb")), files = ["gltfpack", "transform_meshopt", "transform_draco", "web", "exchange"];
if (Number.isFinite(theirs)) {
  let low = theirs - 8, high = theirs; // the least limit per image with which all together are as good is in (low, high]
  const write = async (limit) => {
    run(packtrace, "export", at("ptk"), "-o", at("web_images.glb"), "--profile", "web", "--webp-psnr", limit.toFixed(2), "--force", "-q");
    return imagePsnr(at("portable.glb"), at("web_images.glb"));
  };
  for (let round = 0; round < 4; ++round) {
    const limit = (low + high) / 2;
    if ((await write(limit)) >= theirs) high = limit;
    else low = limit;
  }
  await write(high + 0.005);
  files.splice(4, 0, "web_images");
}
run(packtrace, "export", at("ptk"), "-o", at("exchange.glb"), "--instancing", "--normal-bits", "8", "--webp-psnr", "40", "--force", "-q");
console.log(`${name}: steps of ${step.toPrecision(3)}, packtrace ${own.toPrecision(3)}; errors in gltfpack's steps and degrees: rms, largest`);
for (const ending of files) {
  const file = at(`${ending}.glb`), e = measured[ending] ?? (await measure(`${ending}.glb`));
  check(e.lost <= kMaxLost, `${name}.${ending} has its vertices`, `${(100 * e.lost).toFixed(2)} % are not within ${(16 * reach).toPrecision(3)}`);
  if (ending === "web" || ending === "exchange")
    check(e.normal_max <= kMaxAngle, `${name}.${ending} keeps its normals`, `one is off by ${e.normal_max.toFixed(2)} degrees where triangles keep their area`);
  const psnr = await imagePsnr(at("portable.glb"), file);
  const parts = Object.entries(streams(file)).map(([use, bytes]) => `${use} ${(bytes / 1000).toFixed(0)}`);
  console.log(`${ending}: ${(bytesOf(file) / 1000).toFixed(0)} kB (${parts.join(", ")}); position ${(e.position_rms / step).toFixed(2)}, ` +
    `${(e.position_max / step).toFixed(2)}; normal ${e.normal_rms.toFixed(2)}, ${e.normal_max.toFixed(2)}${e.low > 0 ? `; ${(100 * e.low).toFixed(2)} % of vertices have low triangles only: normal ${e.low_rms.toFixed(2)}, ${(100 * e.low_far).toFixed(3)} % off by more than 3 degrees` : ""}${e.lost > 0 ? `; ${(100 * e.lost).toFixed(2)} % of vertices not found` : ""}${psnr === undefined ? "" : `; images ${psnr.toFixed(1)} dB`}`);
}
const best = Math.min(...["gltfpack", "transform_meshopt"].map((ending) => bytesOf(at(`${ending}.glb`))));
console.log(`web takes ${(bytesOf(at("web.glb")) / best).toFixed(2)} of the smallest meshopt file`);
if (files.includes("web_images")) {
  console.log(`with images as good as glTF-Transform's ${(bytesOf(at("web_images.glb")) / best).toFixed(2)}`);
  check((await imagePsnr(at("portable.glb"), at("web_images.glb"))) >= theirs - 0.05, `${name}.web_images has images of ${theirs.toFixed(1)} dB`);
}
process.exitCode = summary();
