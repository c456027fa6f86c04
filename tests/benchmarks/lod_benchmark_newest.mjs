// Simplifies a mesh with the npm build of meshoptimizer, for lod_benchmark.
// Usage: node lod_benchmark_newest.mjs FOLDER IN OUT
// FOLDER is node_modules/meshoptimizer. IN: counts of vertices, triangles and target triangles, then positions (float) and
// indices (uint32). OUT: the same without the target.
import {readFileSync, writeFileSync} from 'node:fs';
import {resolve} from 'node:path';
import {pathToFileURL} from 'node:url';

const [folder, input, output] = process.argv.slice(2);
const {MeshoptSimplifier} = await import(pathToFileURL(resolve(folder, 'meshopt_simplifier.js')));
await MeshoptSimplifier.ready;

const data = readFileSync(input);
const bytes = data.buffer.slice(data.byteOffset, data.byteOffset + data.length);
const [vertices, triangles, target] = new Uint32Array(bytes, 0, 3);
const positions = new Float32Array(bytes, 12, 3 * vertices);
const indices = new Uint32Array(bytes, 12 + positions.byteLength, 3 * triangles);
const attributes = new Float32Array(vertices); // none, but the function that moves vertices wants some
const [count] = MeshoptSimplifier.simplifyWithUpdate(indices, positions, 3, attributes, 1, [0], null, 3 * target, 1e30);
writeFileSync(output, Buffer.concat([new Uint32Array([vertices, count / 3]), positions, indices.subarray(0, count)]
                                      .map((a) => Buffer.from(a.buffer, a.byteOffset, a.byteLength))));
