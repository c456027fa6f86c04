// Tests of interoperation with other programs. Usage: node run.mjs PACKTRACE ASSETS WORK [SCENES]
//   PACKTRACE  the program
//   ASSETS     folder of this project's scenes
//   WORK       folder for files that are made
//   SCENES     folder with house/scene.pbrt; without it, the house is left out
import fs from "node:fs";
import path from "node:path";
import { drawWithThree } from "./pictures.mjs";
import { run, summary } from "./process.mjs";
import { readSamples } from "./samples.mjs";
import { rewriteWithTools } from "./tools.mjs";
import { validateProfiles } from "./validate.mjs";

const [packtrace, assets, work, scenes] = process.argv.slice(2);
fs.mkdirSync(work, { recursive: true });
await readSamples(packtrace, work);
await validateProfiles(packtrace, assets, work);
const names = { textured: "textured_textured", town: "town_town", room: "room_room" };
const pictures = [names.textured, names.town];
if (scenes && fs.existsSync(path.join(scenes, "house/scene.pbrt"))) {
  run(packtrace, "bake", path.join(scenes, "house/scene.pbrt"), "-o", path.join(work, "house.ptk"), "--for", "shading",
      "--lod", "off", "--force", "-q");
  for (const profile of ["portable", "web", "exchange"])
    run(packtrace, "export", path.join(work, "house.ptk"), "-o", path.join(work, `house.${profile}.glb`), "--profile", profile,
        "--force", "-q");
  pictures.push("house");
}
await drawWithThree(packtrace, work, pictures);
await rewriteWithTools(packtrace, work, Object.values(names));
process.exitCode = summary();
