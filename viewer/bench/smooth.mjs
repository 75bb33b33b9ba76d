// How fast are smooth LODs decoded in Node, on one thread, and how large is the decoder to download?
// `npm run bench -- a.slod b.slod …`; `belvedere mesh smooth FILE -o DIR` writes some.
import { readFileSync } from "node:fs";
import { basename } from "node:path";
import { bundled } from "./bundle.mjs";

/** Each file is decoded so often that about so many triangles come out, after half as many to warm up. */
const MEASURED_TRIANGLES = 4e5;

const { SmoothDecoder, snapshotOf } = await bundled("decoder", "../core/smooth/index.ts");
const decode = (bytes) => {
  const decoder = new SmoothDecoder(2 ** 32);
  decoder.push(bytes);
  return decoder;
};
/** Seconds of CPU time of a run, which others on the machine do not lengthen much. */
const timed = (rounds, run) => {
  for (let i = 0; i < rounds / 2; i += 1) run();
  const before = process.cpuUsage();
  for (let i = 0; i < rounds; i += 1) run();
  const { user, system } = process.cpuUsage(before);
  return (user + system) / 1e6 / rounds;
};
console.log("file                      bytes triangles  decode, with snapshot (million triangles/s)");
for (const path of process.argv.slice(2)) {
  const bytes = new Uint8Array(readFileSync(path));
  const { triangles } = decode(bytes);
  const rate = (seconds) => (triangles / seconds / 1e6).toFixed(2).padStart(6);
  const rounds = Math.ceil(MEASURED_TRIANGLES / triangles);
  const decoded = rate(timed(rounds, () => decode(bytes)));
  const drawn = rate(timed(rounds, () => snapshotOf(decode(bytes))));
  console.log(
    `${basename(path).padEnd(20)} ${String(bytes.length).padStart(10)} ${String(triangles).padStart(9)}  ${decoded} ${drawn}`,
  );
}
