// What does who arrives on a slow line get to see, and when: with levels alone, with smooth LODs, with what grows here, and with
// nothing bundled? `npm run bench:arrival -- http://127.0.0.1:8080 museum [128k]` stands at the first viewpoint until all is
// sharp, each way at once, on a line each. Bodies are counted as they travel, compressed, with 400 bytes of headers for each request;
// nothing is drawn, so drawing takes no time.
import { Agent, get } from "node:http";
import { Readable } from "node:stream";
import { Worker } from "node:worker_threads";
import { gunzipSync } from "node:zlib";
import { bundled, bundledUrl } from "./bundle.mjs";

const [base, name, line = "128k"] = process.argv.slice(2);
if (!name) throw new Error("usage: arrival.mjs URL SCENE [LINE]");
const HEADER_BYTES = 400;
const EVERY_MS = 250;
const LONGEST_MS = 900_000;
const EYE = { viewAngle_rad: (62 * Math.PI) / 180, height_px: 720 };
const TARGET_PX = 1.5;
const SHARES = [0.5, 0.9, 1];
const DOCUMENTS = /\.(json|cell|steps|pop)$/;

const strategy = await bundled("the strategy", "strategy.ts");
const {
  Explorer,
  FETCH_DEFAULTS,
  FetchQueue,
  FrameBudget,
  LINES,
  PublishedScene,
  Throttle,
  Tree,
  webCryptoDigest,
  WorkerGrowing,
} = strategy;
const growing = await bundledUrl("what grows", "../core/models/growworker.ts");

/** Draws nothing. */
class NoHost {
  textures = new Set();
  shown = [];
  async decode(_model, glb, textures) {
    for (const url of textures.keys()) this.textures.add(url);
    return { bytes: glb.byteLength, draw: () => {}, release: () => {} };
  }
  needsTexture(url) {
    return !this.textures.has(url);
  }
  async decodeImpostor(_model, { colour, shape }) {
    for (const { url } of [colour, shape]) this.textures.add(url);
    return { bytes: colour.bytes + shape.bytes, draw: () => {}, release: () => {} };
  }
  blunt() {}
  evict() {}
  drawFar() {}
  show() {}
  draws() {
    return true;
  }
}

/** Begins a worker that grows, as a page does. */
function growworker() {
  const worker = new Worker(
    `const { parentPort } = require("node:worker_threads");
    globalThis.postMessage = (answer, moved) => parentPort.postMessage(answer, moved);
    const ready = import(${JSON.stringify(growing)});
    parentPort.on("message", (data) => ready.then(() => globalThis.onmessage({ data })));`,
    { eval: true },
  );
  const port = { postMessage: (order) => worker.postMessage(order), terminate: () => worker.terminate() };
  worker.on("message", (data) => port.onmessage({ data }));
  worker.on("error", (error) => port.onerror(error));
  return port;
}

const agent = new Agent({ keepAlive: true });

/** An answer as it travels: compressed, and before it as many zeros as its headers and those of its request take. */
function travelling(url, { signal }) {
  return new Promise((resolve, reject) => {
    const request = get(url, { agent, signal, headers: { "Accept-Encoding": "gzip" } }, (answer) => {
      const { statusCode: status, headers } = answer;
      const body = (async function* () {
        yield Buffer.alloc(HEADER_BYTES);
        yield* answer;
      })();
      resolve(new Response(Readable.toWeb(Readable.from(body)), { status, headers }));
    });
    request.on("error", reject);
  });
}

/** The same without those zeros, and unpacked. */
async function unpacked(response) {
  const { status, headers } = response;
  if (headers.get("content-encoding") === "gzip") {
    const bytes = new Uint8Array(await response.arrayBuffer()).subarray(HEADER_BYTES);
    return new Response(gunzipSync(bytes), { status, headers });
  }
  let skip = HEADER_BYTES;
  const body = response.body.pipeThrough(
    new TransformStream({
      transform(piece, controller) {
        if (piece.byteLength > skip) controller.enqueue(piece.subarray(skip));
        skip = Math.max(0, skip - piece.byteLength);
      },
    }),
  );
  return new Response(body, { status, headers });
}

/** `bundles` says whether what the server offers is heard. */
async function arrive({ bundles, ...uses }) {
  let [carried_bytes, documents_bytes] = [0, 0];
  const throttle = new Throttle(async (url, init) => {
    const response = await travelling(url, init);
    const count = new TransformStream({
      transform(piece, controller) {
        carried_bytes += piece.byteLength;
        if (DOCUMENTS.test(url)) documents_bytes += piece.byteLength;
        controller.enqueue(piece);
      },
    });
    if (!bundles) response.headers.delete("link");
    return new Response(response.body.pipeThrough(count), response);
  });
  throttle.line = LINES.find((one) => one.name === line);
  const fetch = async (url, init) => unpacked(await throttle.fetch(url, init));
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, fetch, digest: webCryptoDigest() });
  const began_ms = performance.now();
  const scene = await PublishedScene.open(queue, new Tree(base), name);
  const budget = new FrameBudget(1e9, () => performance.now());
  const problems = [];
  const explorer = new Explorer(
    scene,
    new NoHost(),
    budget,
    { memory_limit_bytes: 1.2e9, target_px: TARGET_PX, uses, growing: new WorkerGrowing(growworker) },
    { changed: () => {}, problem: (error) => problems.push(error) },
  );
  explorer.follow({ ...EYE, position: scene.manifest.viewpoints[0].position }, [0, 0, 0]);
  const reached = new Map();
  const curve = [];
  for (;;) {
    await new Promise((resolve) => setTimeout(resolve, EVERY_MS));
    const t_ms = performance.now() - began_ms;
    const quality = explorer.quality() ?? { here: 0, sharp: 0 };
    const { requests } = queue.tally;
    const bytes = carried_bytes;
    curve.push([t_ms / 1000, bytes, quality.here, quality.sharp]);
    for (const [what, share] of Object.entries(quality)) {
      for (const level of SHARES) {
        const key = `${what} ${100 * level} %`;
        if (share >= level && !reached.has(key)) reached.set(key, { s: t_ms / 1000, bytes, documents_bytes, requests });
      }
    }
    if (reached.has("sharp 100 %") || t_ms > LONGEST_MS) break;
  }
  explorer.close();
  if (problems.length > 0) throw problems[0];
  return { reached, curve };
}

const RUNS = {
  "levels alone": { smooth: false, impostors: false, rules: false, bundles: true },
  "with smooth LODs": { impostors: false, rules: false, bundles: true },
  "… and what grows": { impostors: false, bundles: true },
  "… without bundles": { impostors: false, bundles: false },
};
const runs = await Promise.all(Object.values(RUNS).map(arrive));
const row = (cells) => console.log(`| ${cells.join(" | ")} |`);
const megabytes = (bytes) => (bytes / 1e6).toFixed(2);
const cell = (at) =>
  at
    ? `${at.s.toFixed(0)} s, ${megabytes(at.bytes)} MB (${megabytes(at.documents_bytes)} of documents), ${at.requests} requests`
    : "never";
console.log();
row([`${name}, ${line}`, ...Object.keys(RUNS)]);
row(["---", ...runs.map(() => "---")]);
for (const key of ["here", "sharp"].flatMap((what) => SHARES.map((share) => `${what} ${100 * share} %`))) {
  row([key, ...runs.map(({ reached }) => cell(reached.get(key)))]);
}
/** Mean share over the first seconds; whoever was done sooner stays at 1. */
const mean = ({ curve }, index, until_s) => {
  const samples = curve.filter(([s]) => s <= until_s);
  const missing = Math.max(0, (1000 * until_s) / EVERY_MS - samples.length);
  return (samples.reduce((sum, sample) => sum + sample[index], 0) + missing) / (samples.length + missing);
};
for (const until_s of [30, 60, 120]) {
  const shares = (run) => [2, 3].map((i) => `${(100 * mean(run, i, until_s)).toFixed(1)} %`).join(", ");
  row([`mean of the first ${until_s} s: here, sharp`, ...runs.map(shares)]);
}
