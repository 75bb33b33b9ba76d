// How fast do rules grow in Node, on one thread, and how large is what grows them to download?
// `npm run bench:procedural`, for one model alone `npm run bench:procedural -- tree.dcg`; the models and the table of
// `cargo bench -p belvedere-scene`, and a row of houses.
import { readFileSync } from "node:fs";
import { bundled } from "./bundle.mjs";

/** Each model is grown again until so much time has passed. */
const LEAST_S = 1;
/** So long before, until it is compiled. */
const WARM_S = 0.5;
/** So many triangles grow between looks at the clock, which take longer than some models. */
const UNWATCHED = 1e5;

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
  houses: 'import "houses.dcg" as houses for i in 60 move(12 * i, 0, 0) houses.house(11, 9 + i / 1000, mod(i, 5))',
};
/** CPU time, which others on the machine do not lengthen much. */
const seconds = () => {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1e6;
};
const [wanted] = process.argv.slice(2);
console.log("| model | triangles | steps | triangles/s | in the fastest round |\n|---|---|---|---|---|");
for (const [name, text] of Object.entries(models)) {
  if (wanted !== undefined && wanted !== name) continue;
  const program = readProgram(name, text, load);
  const { triangles, steps } = grow(program).usage;
  const warm = seconds();
  while (seconds() - warm < WARM_S) grow(program);
  const start = seconds();
  let rounds = 0;
  let fastest = Infinity;
  while (seconds() - start < LEAST_S) {
    for (let grown = 0; grown < UNWATCHED; grown += triangles, rounds += 1) {
      const before = performance.now();
      grow(program);
      fastest = Math.min(fastest, performance.now() - before);
    }
  }
  const rate = ((triangles * rounds) / (seconds() - start) / 1e6).toFixed(1);
  const best = (triangles / fastest / 1e3).toFixed(1);
  console.log(`| ${name} | ${triangles} | ${steps} | ${rate} M, ${rounds} times | ${best} M |`);
}
