// What can be seen from the first viewpoint of a scene, and how much of it has come? Draws nothing.
// node examples/look.mjs http://127.0.0.1:8080/ museum
import {
  Explorer,
  FETCH_DEFAULTS,
  FetchQueue,
  FrameBudget,
  PublishedScene,
  Tree,
  webCryptoDigest,
} from "belvedere-viewer/core";

const [base, name] = process.argv.slice(2);

async function look() {
  if (!name) throw new Error("name a tree and a scene: node examples/look.mjs http://127.0.0.1:8080/ museum");
  const queue = new FetchQueue({
    ...FETCH_DEFAULTS,
    fetch: (url, init) => fetch(url, init),
    digest: webCryptoDigest(),
  });
  const scene = await PublishedScene.open(queue, new Tree(base), name);

  // Whoever draws decodes GLBs here, and answers what they take and how they come into the picture.
  const models = new Map();
  const host = {
    decode: async (model, glb) => ({
      bytes: glb.byteLength,
      draw: () => models.set(model, glb.byteLength),
      release: () => {},
    }),
    decodeImpostor: async () => ({ bytes: 0, draw: () => {}, release: () => {} }),
    needsTexture: () => false,
    evict: (model) => models.delete(model),
    blunt: () => {},
    drawFar: () => {},
    show: () => {},
    draws: (object) => models.has(explorer.placed(object)?.model.model),
  };
  // Nothing has to be drawn in time, so decoding may take as long as it takes.
  const budget = new FrameBudget(Number.POSITIVE_INFINITY, () => performance.now());
  const limits = { memory_limit_bytes: 256e6, target_px: 1.5, uses: { impostors: false, rules: false } };
  const events = { changed: () => {}, problem: (error) => console.error(String(error)) };
  const explorer = new Explorer(scene, host, budget, limits, events);

  const { position } = scene.manifest.viewpoints[0];
  explorer.follow({ position, viewAngle_rad: 1, height_px: 1080 }, [0, 0, 0]);
  while (!explorer.settled) await new Promise((resolve) => setTimeout(resolve, 50));
  const { loaded_bytes, total_bytes } = explorer.progress();
  const where = explorer.cellId === undefined ? "in no cell that is known" : `cell ${explorer.cellId}`;
  console.log(`${scene.manifest.title}, ${where}: ${explorer.visible.length} objects can be seen`);
  console.log(`${models.size} models are here, ${loaded_bytes} of ${total_bytes} bytes of the first picture`);
  explorer.close();
}

/** What went wrong, for a person. */
function told({ kind, status, message }) {
  if (status === 404) return `there is no scene ${name} at ${base}`;
  return kind === "unreachable" && status === undefined ? `nobody answers at ${base}` : message;
}

try {
  await look();
} catch (error) {
  console.error(told(error));
  process.exitCode = 1;
}
