// What grows out of a file of rules? The evaluator of the core in Node: `node examples/grow.mjs tree.dcg seed=3 height=12`.
import { existsSync, readFileSync, realpathSync } from "node:fs";
import { basename, dirname, join, sep } from "node:path";
import { procedural } from "belvedere-viewer/core";

const [file = "", ...given] = process.argv.slice(2);

/** What stands in a file, or why that cannot be told, in words for a person. */
function read(path, shown) {
  try {
    return readFileSync(path, "utf8");
  } catch (error) {
    throw new Error(error.code === "ENOENT" ? `there is no file ${shown}` : `cannot read ${shown}: ${error.message}`);
  }
}

/** A file beside the rules. Neither a path nor a link leads out of their folder. */
function load(path) {
  const folder = realpathSync(dirname(file));
  const beside = join(folder, procedural.insideFolder(path));
  if (!existsSync(beside)) throw new Error("there is no such file beside the rules");
  const found = realpathSync(beside);
  if (!found.startsWith(join(folder, sep))) throw new Error("a link leads out of the source's folder");
  return read(found, path);
}

/** A number or a list, as JSON writes them. */
function value(name, text) {
  let known;
  try {
    known = procedural.valueFromJson(JSON.parse(text));
  } catch {
    // What is no JSON is no value either.
  }
  if (known === undefined) throw new Error(`${name} is ${text}; write a number or a list of numbers`);
  return known;
}

function grown() {
  if (file === "") throw new Error("name a file of rules: node examples/grow.mjs tree.dcg seed=3 height=12");
  const values = new Map(given.map((argument) => argument.split("=")));
  const seed = Number(values.get("seed") ?? 0);
  values.delete("seed");
  const parameters = new Map([...values].map(([name, text = ""]) => [name, value(name, text)]));
  const program = procedural.readProgram(basename(file), read(file, file), load);
  return procedural.grow(program, { seed, parameters });
}

/** A model in a sentence. */
function told(model) {
  let triangles = 0;
  for (const { part } of procedural.instancesOf(model)) {
    for (const mesh of model.parts[part].meshes) triangles += mesh.triangles;
  }
  // What draws nothing has no height.
  if (triangles === 0) return "the rules draw nothing";
  return `${triangles} triangles of ${model.parts.length} parts, up to ${model.parts[0].bounds.max[1].toFixed(2)} m high`;
}

try {
  console.log(told(grown()));
} catch (error) {
  // What is wrong with rules is told with file, line, column and the way out.
  console.error(error.message);
  process.exitCode = 1;
}
