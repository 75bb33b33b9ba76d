// What grows out of a file of rules? The evaluator of the core in Node: `node examples/grow.mjs tree.dcg seed=3 height=12`.
import { readFileSync, realpathSync } from "node:fs";
import { basename, dirname, join, sep } from "node:path";
import { procedural } from "belvedere-viewer/core";

const [file = "", ...given] = process.argv.slice(2);
const folder = realpathSync(dirname(file));
const load = (path) => {
  // Neither a path nor a link leads out of the folder of the rules.
  const found = realpathSync(join(folder, procedural.insideFolder(path)));
  if (!found.startsWith(join(folder, sep))) throw new Error("a link leads out of the source's folder");
  return readFileSync(found, "utf8");
};
const values = new Map(given.map((argument) => argument.split("=")));
const seed = Number(values.get("seed") ?? 0);
values.delete("seed");
// Numbers are values; lists are made by `valueFromJson`.
const parameters = new Map([...values].map(([name, text]) => [name, procedural.valueFromJson(JSON.parse(text))]));

try {
  const program = procedural.readProgram(basename(file), readFileSync(file, "utf8"), load);
  const grown = procedural.grow(program, { seed, parameters });
  let triangles = 0;
  for (const { part } of procedural.instancesOf(grown)) {
    for (const mesh of grown.parts[part].meshes) triangles += mesh.triangles;
  }
  const { max } = grown.parts[0].bounds;
  console.log(`${triangles} triangles of ${grown.parts.length} parts, up to ${max[1].toFixed(2)} m high`);
} catch (error) {
  if (!(error instanceof procedural.DcgError)) throw error;
  // It names file, line, column and the way out.
  console.error(error.message);
  process.exitCode = 1;
}
