// Every profile of every scene of assets/ passes the Khronos validator without errors or warnings, and comes back with
// its triangles and instances.
import fs from "node:fs";
import path from "node:path";
import validator from "gltf-validator";
import { check, json, run } from "./process.mjs";

/** Main files of scenes: those that begin a world. */
function scenes(folder) {
  const found = [];
  for (const entry of fs.readdirSync(folder, { withFileTypes: true, recursive: true })) {
    const file = path.join(entry.parentPath ?? entry.path, entry.name);
    if (entry.name.endsWith(".pbrt") && fs.readFileSync(file, "latin1").includes("WorldBegin")) found.push(file);
  }
  return found.sort();
}

export async function validate(file, what) {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
    uri: path.basename(file),
    externalResourceFunction: async (uri) => new Uint8Array(fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri)))),
  });
  const bad = report.issues.messages.filter((m) => m.severity < 2);
  check(report.issues.numErrors + report.issues.numWarnings === 0, `${what} is valid`,
        bad.slice(0, 3).map((m) => `${m.code} ${m.pointer} ${m.message}`).join("; "));
}

export async function validateProfiles(packtrace, assets, work) {
  for (const scene of scenes(assets)) {
    const name = path.relative(assets, scene).replaceAll("/", "_").replace(".pbrt", "");
    const ptk = path.join(work, `${name}.ptk`);
    if (/_empty_world$/.test(name)) continue; // bake refuses it
    run(packtrace, "bake", scene, "-o", ptk, "--for", "shading", "--force", "-q", "--lod", "off");
    const baked = json(packtrace, "info", ptk);
    for (const profile of ["portable", "web", "exchange"])
      for (const ending of ["glb", "gltf"]) {
        const out = path.join(work, `${name}.${profile}.${ending}`);
        const report = json(packtrace, "export", ptk, "-o", out, "--profile", profile, "--force");
        await validate(out, `${name}, ${profile}, ${ending}`);
        if (ending !== "glb" || baked.triangles === 0) continue;
        const back = json(packtrace, "info", out);
        const flat = report.collapsed_triangles > 0; // an instanced one counts once only
        check(flat || back.placed_triangles === baked.placed_triangles, `${name}, ${profile} comes back`,
              `${back.placed_triangles} triangles instead of ${baked.placed_triangles}`);
        check(back.problems.errors === 0, `${name}, ${profile} is read without errors`);
      }
  }
}
