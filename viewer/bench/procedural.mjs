// How fast do rules grow in Node, on one thread, and how large is what grows them to download?
// `npm run bench:procedural`; the same models as `cargo bench -p belvedere-scene`.
import { readFileSync } from "node:fs";
import { bundled } from "./bundle.mjs";

/** Each model is grown again until so much time has passed. */
const LEAST_S = 1;

const { grow, readProgram } = await bundled("evaluator", "../core/procedural/index.ts");
console.log();
const load = (name) => readFileSync(new URL(`../../content/${name}`, import.meta.url), "utf8");
const models = {
  boxes: "for i in 400 for j in 400 move(i, 0, j) box(0.5, 1, 0.5)",
  cylinders: "for i in 200 for j in 200 move(i, 0, j) turn(i) cylinder(0.4, 3)",
  spheres: "for i in 60 for j in 60 move(i, 0, j) sphere(0.4, sides = 24)",
  "a height field": "heights x, z in 100 by 100 steps 1000 by 1000 = x * z / 100",
  "tree.dcg": load("tree.dcg"),
  "conifer.dcg": load("conifer.dcg"),
  "terrain.dcg": load("terrain.dcg"),
};
/** CPU time, which others on the machine do not lengthen much. */
const seconds = () => {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1e6;
};
console.log("| model | triangles | triangles/s |\n|---|---|---|");
for (const [name, text] of Object.entries(models)) {
  const program = readProgram(name, text, load);
  const { triangles } = grow(program).usage;
  const start = seconds();
  let rounds = 0;
  for (; seconds() - start < LEAST_S; rounds += 1) grow(program);
  console.log(`| ${name} | ${triangles} | ${((triangles * rounds) / (seconds() - start) / 1e6).toFixed(1)} M |`);
}
