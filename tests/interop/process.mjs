// Runs programs and collects failures.
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";

let failures = 0;
let checks = 0;

/** Reports a check; the run goes on. */
export function check(condition, what, detail = "") {
  ++checks;
  if (condition) return;
  ++failures;
  console.error(`FAILED: ${what}${detail === "" ? "" : `: ${detail}`}`);
}

export function summary() {
  console.log(`${checks} checks, ${failures} failed`);
  return failures === 0 ? 0 : 1;
}

/** Runs a program; returns its standard output. Throws an Error with its messages if it fails. */
export function run(program, ...args) {
  const result = spawnSync(program, args, { encoding: "utf8", maxBuffer: 1 << 28 });
  if (result.error) throw result.error;
  if (result.status !== 0) throw new Error(`${path.basename(program)} ${args.join(" ")}: ${result.stderr || result.stdout}`);
  return result.stdout;
}

export const json = (program, ...args) => JSON.parse(run(program, ...args, "--json", "-"));

/** Folder of these scripts. */
export const kFolder = path.dirname(fileURLToPath(import.meta.url));

/** Program of a package. */
export const tool = (name) => path.join(kFolder, "node_modules", ".bin", name);

export function bytesOf(file) {
  return fs.statSync(file).size;
}

