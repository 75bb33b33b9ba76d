// Which triangles of a smooth LOD does an eye need that comes nearer, and goes away again? `node examples/select.mjs model.slod`.
import { readFileSync } from "node:fs";
import { select, smooth } from "belvedere-viewer/core";

const decoder = new smooth.SmoothDecoder(256e6);
// Any beginning of the stream will do; what comes later is taken in by `grow`.
decoder.push(readFileSync(process.argv[2]));
const { header } = decoder;
const { positions } = smooth.snapshotOf(decoder);
const xs = positions.filter((_, i) => i % 3 === 0);
const [near, far] = [Math.min(...xs), Math.max(...xs)];
const size = Math.max(far - near, header.step);

// Nothing of it need be there for an eye that is far away.
const selection = new select.Selection(new select.ClusterTree(decoder), 0);
const pixels = 1080 / (2 * Math.tan(0.5));
for (const sizes of [1000, 100, 10, 1, 1000]) {
  const eye = [far + sizes * size, positions[1], positions[2]];
  // Seen all around: a renderer gives the planes of its view.
  const view = { eye, planes: [], pixels, mostError_px: 1, outside: 1 };
  // A frame does a bounded amount of work, and the next goes on there.
  let frames = 1;
  while (!selection.update(view, 1000).isSettled) frames += 1;
  const { indices } = selection.snapshot(decoder);
  const triangles = indices.reduce((sum, { length }) => sum + length / 3, 0);
  console.log(`${sizes} times its size away: ${triangles} of ${header.triangles} triangles, after ${frames} frames`);
}
