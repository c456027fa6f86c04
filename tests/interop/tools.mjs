// glTF-Transform reads and rewrites exports; what it and gltfpack write comes back with the counts that they report.
import fs from "node:fs";
import path from "node:path";
import { NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import { MeshoptDecoder } from "meshoptimizer";
import draco3d from "draco3dgltf";
import { validate } from "./validate.mjs";
import { bytesOf, check, json, run, tool } from "./process.mjs";

/** Triangles of a primitive; those of strips with equal corners only join parts. */
function trianglesOf(primitive) {
  const indices = primitive.getIndices()?.getArray();
  if (primitive.getMode() !== 5) return (indices?.length ?? primitive.getAttribute("POSITION").getCount()) / 3;
  let triangles = 0;
  for (let i = 0; i + 2 < indices.length; ++i)
    triangles += indices[i] !== indices[i + 1] && indices[i + 1] !== indices[i + 2] && indices[i] !== indices[i + 2];
  return triangles;
}

/** Triangles of all nodes of a document, instances included, as glTF-Transform sees them. */
async function placedTriangles(file) {
  const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
    "meshopt.decoder": MeshoptDecoder,
    "draco3d.decoder": await draco3d.createDecoderModule(),
  });
  await MeshoptDecoder.ready;
  const document = await io.read(file);
  let total = 0;
  for (const node of document.getRoot().listNodes()) {
    if (!node.getMesh()) continue;
    let triangles = 0;
    for (const primitive of node.getMesh().listPrimitives()) triangles += trianglesOf(primitive);
    const instances = node.getExtension("EXT_mesh_gpu_instancing");
    total += triangles * (instances ? instances.listAttributes()[0].getCount() : 1);
  }
  return total;
}

export async function rewriteWithTools(packtrace, work, names) {
  for (const name of names) {
    for (const profile of ["portable", "web", "exchange"]) {
      const from = path.join(work, `${name}.${profile}.glb`);
      const copy = path.join(work, `${name}.${profile}.copy.glb`);
      run(tool("gltf-transform"), "copy", from, copy);
      await validate(copy, `${name}, ${profile}, rewritten by glTF-Transform`);
      const own = json(packtrace, "info", from).placed_triangles;
      check((await placedTriangles(from)) === own, `glTF-Transform counts the triangles of ${name}, ${profile}`);
      check(json(packtrace, "info", copy).placed_triangles === own, `${name}, ${profile}, rewritten, comes back`);
    }
    const portable = path.join(work, `${name}.portable.glb`);
    const packed = path.join(work, `${name}.gltfpack.glb`), report = path.join(work, `${name}.gltfpack.json`);
    run(tool("gltfpack"), "-i", portable, "-o", packed, "-cc", "-mi", "-vp", "16", "-r", report);
    const expected = JSON.parse(fs.readFileSync(report, "utf8")).render.triangleCount;
    const back = json(packtrace, "info", packed);
    check(back.placed_triangles === expected, `gltfpack's ${name} comes back`,
          `${back.placed_triangles} triangles instead of ${expected}`);
    for (const codec of ["draco", "meshopt"]) {
      const optimized = path.join(work, `${name}.${codec}.glb`);
      run(tool("gltf-transform"), "optimize", portable, optimized, "--compress", codec, "--texture-compress", "webp",
          "--simplify", "false");
      const counted = await placedTriangles(optimized);
      check(json(packtrace, "info", optimized).placed_triangles === counted, `glTF-Transform's ${name}, ${codec} comes back`);
    }
    console.log(`${name}: web ${bytesOf(path.join(work, `${name}.web.glb`))} bytes, gltfpack -cc -mi ${bytesOf(packed)}`);
  }
}
