// What does who arrives on a slow line get to see, and when: with smooth LODs and with levels alone?
// `npm run bench:arrival -- http://127.0.0.1:8080 museum [128k]` stands at the first viewpoint until all is sharp, twice at
// once. Bodies are counted without content encoding; nothing is drawn, so drawing takes no time.
import { bundled } from "./bundle.mjs";

const [base, name, line = "128k"] = process.argv.slice(2);
if (!name) throw new Error("usage: arrival.mjs URL SCENE [LINE]");
const EVERY_MS = 250;
const LONGEST_MS = 900_000;
const EYE = { viewAngle_rad: (62 * Math.PI) / 180, height_px: 720 };
const TARGET_PX = 1.5;
const SHARES = [0.5, 0.9, 1];

const { Explorer, FETCH_DEFAULTS, FetchQueue, FrameBudget, LINES, PublishedScene, Throttle, Tree, webCryptoDigest } =
  await bundled("the strategy", "strategy.ts");

/** Draws nothing. */
class NoHost {
  textures = new Set();
  shown = [];
  async upload(_model, glb, textures) {
    for (const url of textures.keys()) this.textures.add(url);
    return glb.byteLength;
  }
  needsTexture(url) {
    return !this.textures.has(url);
  }
  evict() {}
  show() {}
  draws() {
    return true;
  }
}

async function arrive(smooth) {
  const throttle = new Throttle((url, init) => fetch(url, init));
  throttle.line = LINES.find((one) => one.name === line);
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, fetch: throttle.fetch, digest: webCryptoDigest() });
  const began_ms = performance.now();
  const scene = await PublishedScene.open(queue, new Tree(base), name);
  const budget = new FrameBudget(1e9, () => performance.now());
  const problems = [];
  const explorer = new Explorer(
    scene,
    new NoHost(),
    budget,
    { memory_limit_bytes: 1.2e9, target_px: TARGET_PX, smooth },
    { changed: () => {}, problem: (error) => problems.push(error) },
  );
  explorer.follow({ ...EYE, position: scene.manifest.viewpoints[0].position }, [0, 0, 0]);
  const reached = new Map();
  const curve = [];
  for (;;) {
    await new Promise((resolve) => setTimeout(resolve, EVERY_MS));
    const t_ms = performance.now() - began_ms;
    const quality = explorer.quality() ?? { here: 0, sharp: 0 };
    const { bytes, requests } = queue.tally;
    curve.push([t_ms / 1000, bytes, quality.here, quality.sharp]);
    for (const [what, share] of Object.entries(quality)) {
      for (const level of SHARES) {
        const key = `${what} ${100 * level} %`;
        if (share >= level && !reached.has(key)) reached.set(key, { s: t_ms / 1000, bytes, requests });
      }
    }
    if (reached.has("sharp 100 %") || t_ms > LONGEST_MS) break;
  }
  explorer.close();
  if (problems.length > 0) throw problems[0];
  return { reached, curve };
}

const [levels, both] = await Promise.all([arrive(false), arrive(true)]);
const cell = (at) =>
  at ? `${at.s.toFixed(0)} s, ${(at.bytes / 1e6).toFixed(2)} MB, ${at.requests} requests` : "never";
console.log(`\n| ${name}, ${line} | levels alone | with smooth LODs |\n|---|---|---|`);
for (const key of ["here", "sharp"].flatMap((what) => SHARES.map((share) => `${what} ${100 * share} %`))) {
  console.log(`| ${key} | ${cell(levels.reached.get(key))} | ${cell(both.reached.get(key))} |`);
}
const mean = ({ curve }, index, until_s) => {
  const samples = curve.filter(([s]) => s <= until_s);
  return samples.reduce((sum, sample) => sum + sample[index], 0) / samples.length;
};
for (const until_s of [30, 60, 120]) {
  const shares = [levels, both].map((run) => [2, 3].map((i) => `${(100 * mean(run, i, until_s)).toFixed(1)} %`));
  console.log(`| mean of ${until_s} s: here, sharp | ${shares.map((share) => share.join(", ")).join(" | ")} |`);
}
