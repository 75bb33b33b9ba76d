// What did the main thread of a page do, and when? Sums the samples of a CPU profile over spans of time, by who had them run. The browser's trace
// says how long the thread really ran in each task: the rest of it went to others on the machine. That time is shared out among the samples
// of the task, so all sums are CPU time. Files are told apart by the names that `frames.mjs` gives to chunks: `core-strategy-plan.js` for `core/strategy/plan.ts`,
// `lib-three_core.js` for a part of three.js.

/** What seems to run for longer than that between two samples was interrupted. */
const LONGEST_SAMPLE_US = 500;

/** Who has the main thread busy: what a frame of ours can wait for. */
export const KINDS = ["streaming", "drawing", "page", "company", "garbage", "browser"];

/** The functions of three.js that hand something new to the graphics card while it draws: what streaming has brought. */
const UPLOADS = new Set([
  "acquireProgram",
  "createBuffer",
  "getProgram",
  "initMaterial",
  "setupVertexAttributes",
  "updateBuffer",
  "uploadTexture",
]);

const OURS = /\/(core|three)-[^/]*$/;
/** Choosing what of all that is here is in view belongs to each picture. */
const isLook = (functionName, url) => functionName === "look" && url.endsWith("/three-modelhost.js");
const LIBRARY = /\/lib-[^/]*$/;
const PAGE = /\/(ui-[^/]*|index[^/]*)$/;
/** Other people are not streamed. */
const COMPANY =
  /\/(three-(avatars|bodymaterial|crowds|doors|overlay|person|personcapture|wardrobe)|core-live-[^/]*)\.js$/;
const SPECIAL = { "(idle)": "idle", "(garbage collector)": "garbage", "(program)": "browser" };

/** Who is answerable for a function, given who called it. */
function kindOf({ functionName, url }, caller) {
  if (functionName in SPECIAL) return SPECIAL[functionName];
  // To prepare what will be drawn is not to draw, though the stage is asked for it.
  if (url.endsWith("/three-programs.js")) return "streaming";
  if (caller === "drawing") return UPLOADS.has(functionName) ? "streaming" : caller;
  if (url.endsWith("/three-stage.js") || isLook(functionName, url)) return "drawing";
  if (caller === "company" || COMPANY.test(url)) return "company";
  if (OURS.test(url)) return "streaming";
  if (caller === "streaming") return caller;
  // What continues by itself after waiting was begun by us: nothing else here uses libraries.
  if (LIBRARY.test(url) && caller === "browser") return "streaming";
  return PAGE.test(url) ? "page" : caller;
}

/** The tasks of the busiest page in a trace, in order: when each ran, and for how long its thread really did. */
export function tasksOf(events) {
  const isPage = ({ name, args }) => name === "thread_name" && args.name === "CrRendererMain";
  const threads = events
    .filter(isPage)
    .map(({ pid, tid }) =>
      events.filter((one) => one.name === "RunTask" && one.ph === "X" && one.pid === pid && one.tid === tid),
    );
  const total = (tasks) => tasks.reduce((sum, { tdur = 0 }) => sum + tdur, 0);
  const [busiest = []] = threads.sort((a, b) => total(b) - total(a));
  const tasks = busiest.map(({ ts, dur, tdur = dur }) => ({
    start_us: ts,
    end_us: ts + dur,
    ran_us: Math.min(dur, tdur),
  }));
  return tasks.sort((a, b) => a.start_us - b.start_us);
}

/** What seemed to run from `at_ms` on for `seems_ms`, and did for `ms`. `at_ms` is on the page's own clock, which began at `origin_s`. */
export function samplesOf({ nodes, samples, timeDeltas, startTime }, tasks, origin_s) {
  const byId = new Map(nodes.map((node) => [node.id, node]));
  const known = new Map();
  const visit = (node, caller, place) => {
    const { functionName, url } = node.callFrame;
    const kind = kindOf(node.callFrame, caller);
    const file = url.slice(url.lastIndexOf("/") + 1).replace(/\.js$/, "");
    const own = file === "" ? place : `${file} ${functionName || "(anonymous)"}`;
    known.set(node.id, { kind, place: own });
    for (const child of node.children ?? []) visit(byId.get(child), kind, own);
  };
  visit(nodes[0], "browser", "");
  let at_us = startTime;
  let next = 0;
  const weights = new Map();
  const found = samples.map((id, i) => {
    at_us += timeDeltas[i];
    const lasts_us = Math.max(0, timeDeltas[i + 1] ?? 0);
    while (next < tasks.length && tasks[next].end_us <= at_us) next += 1;
    const task = tasks[next]?.start_us <= at_us ? tasks[next] : undefined;
    const weight = Math.min(lasts_us, LONGEST_SAMPLE_US);
    weights.set(task, (weights.get(task) ?? 0) + weight);
    return { id, at_us, lasts_us, task, weight };
  });
  return found.map(({ id, at_us, lasts_us, task, weight }) => ({
    at_ms: at_us / 1000 - 1000 * origin_s,
    seems_ms: lasts_us / 1000,
    ms: (task && weight > 0 ? (task.ran_us * weight) / weights.get(task) : lasts_us) / 1000,
    ...known.get(id),
  }));
}

/** What of each kind ran in each of some spans, which do not overlap and rise. */
export function spent(samples, spans) {
  const sums = spans.map(() => Object.fromEntries(KINDS.map((kind) => [kind, { ms: 0, places: new Map() }])));
  let first = 0;
  for (const { at_ms, seems_ms, ms, kind, place } of samples) {
    while (first < spans.length && spans[first].end_ms <= at_ms) first += 1;
    let left_ms = seems_ms;
    for (let i = first; i < spans.length && left_ms > 0; i += 1) {
      const { start_ms, end_ms } = spans[i];
      const seemed_ms = Math.min(end_ms, at_ms + seems_ms) - Math.max(start_ms, at_ms);
      if (seemed_ms <= 0) break;
      left_ms -= seemed_ms;
      const sum = sums[i][kind];
      if (!sum) continue;
      const within_ms = (seemed_ms * ms) / seems_ms;
      sum.ms += within_ms;
      sum.places.set(place, (sum.places.get(place) ?? 0) + within_ms);
    }
  }
  return sums;
}

/** The places that took most of some sums, with what they took. */
export function most(sums, count) {
  const all = new Map();
  for (const { places } of sums) for (const [place, ms] of places) all.set(place, (all.get(place) ?? 0) + ms);
  return [...all].sort(([, a], [, b]) => b - a).slice(0, count);
}

/** The number that this share of some does not exceed. */
export function quantile(numbers, share) {
  const sorted = [...numbers].sort((a, b) => a - b);
  return sorted[Math.max(0, Math.ceil(share * sorted.length) - 1)] ?? 0;
}
