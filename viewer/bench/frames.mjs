// How long does streaming keep the main thread of a page busy, in each frame? `npm run bench:frames -- http://127.0.0.1:8080 town` goes
// round a world in headless Chromium: it arrives, then at each viewpoint jumps there, walks, and flies on to the next one. That is done on
// the line as it is, on a slow one, and with pictures. In the others nothing is rasterised, as if a graphics card did it: everything that the
// page itself does for a picture is done. `--run 3G` takes one of them, `--leg 5` shortens each part to so many seconds, and `--save DIR`
// keeps the profiles, which the developer tools of browsers open.
//
// A sampling profiler says what ran, and who is answerable for it (`mainthread.mjs`): streaming is all that `core/` and `three/` do, from
// documents to what the graphics card is given, whenever it runs between the beginnings of two frames. What the machine makes of a known
// piece of work is measured before and after, on a page that does nothing else: it is shared with others.
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { build, preview } from "vite";
import { DESKTOP, launch, watchPrograms } from "../e2e/browser.mjs";
import { KINDS, most, quantile, samplesOf, spent, tasksOf } from "./mainthread.mjs";

const { positionals, values } = parseArgs({
  allowPositionals: true,
  options: { run: { type: "string", multiple: true }, leg: { type: "string" }, save: { type: "string" } },
});
const [base, scene = "town"] = positionals;
if (!base) throw new Error("usage: frames.mjs URL [SCENE] [--run NAME]… [--leg SECONDS] [--save DIR]");
const RUNS = [
  { name: "as it is", line: "", rasterises: false },
  { name: "3G", line: "3G", rasterises: false },
  { name: "with pictures", line: "", rasterises: true },
];
const runs = RUNS.filter(({ name }) => values.run?.includes(name) ?? true);
const LEG_S = Number(values.leg ?? 10);
const ARRIVE_S = 2 * LEG_S;
const IDLE_S = Math.min(5, LEG_S);
const SAMPLE_US = 250;
const LONG_MS = 50;
/** Long tasks count from here on. */
const BEGUN_MS = 1000;
const GOAL_MS = 4;
const [WALK_M, TURN_RAD, FLY_MPS] = [8, 1.9, 12];
const SHARES = { p50: 0.5, p95: 0.95, p99: 0.99, max: 1 };

/** Builds the viewer with a file for each module, whose names and functions keep what they are called in the sources. */
async function buildTo(outDir) {
  const root = new URL("..", import.meta.url).pathname;
  const inRoom = /\/viewer\/(core|three|ui)\/(.+)\.ts$/;
  const groups = [
    {
      debugName: "rooms",
      test: inRoom,
      name: (id) => inRoom.exec(id)?.slice(1).join("-").replaceAll("/", "-") ?? null,
    },
    {
      debugName: "libraries",
      test: /node_modules/,
      name: (id) => `lib-${/([^/]+)\.js$/.exec(id)?.[1].replace(/\W/g, "_")}`,
    },
  ];
  const output = {
    chunkFileNames: "assets/[name].js",
    codeSplitting: { groups, includeDependenciesRecursively: false },
  };
  const rollupOptions = { preserveEntrySignatures: false, input: { index: join(root, "index.html") }, output };
  await build({ root, logLevel: "error", build: { outDir, emptyOutDir: true, minify: false, rollupOptions } });
}

/** In the page: notes when frames begin and which tasks were long, and has a known piece of work to do. */
function takeNotes() {
  const notes = { frames: [], long: [], work: [] };
  window.notes = notes;
  const request = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (callback) =>
    request((now) => {
      notes.frames.push(performance.now());
      callback(now);
    });
  new PerformanceObserver((list) => {
    for (const { startTime, duration } of list.getEntries()) notes.long.push([startTime, duration]);
  }).observe({ type: "longtask", buffered: true });
  const text = JSON.stringify(Array.from({ length: 1500 }, (_, i) => ({ id: `o${i}`, at: [i, i / 3, -i] })));
  const work = () => JSON.parse(text).sort((a, b) => b.at[1] - a.at[1]).length;
  window.workFor = (ms) =>
    new Promise((done) => {
      const end = performance.now() + ms;
      const frame = () => {
        const start = performance.now();
        work();
        notes.work.push(performance.now() - start);
        if (start < end) requestAnimationFrame(frame);
        else done(notes);
      };
      requestAnimationFrame(frame);
    });
}

/** What the machine makes of a page that does one known piece of work in each frame. */
async function calibrate(page, origin) {
  await page.goto(`${origin}/idle.html`);
  const { work, frames, long } = await page.evaluate((ms) => window.workFor(ms), 1000 * IDLE_S);
  const gaps = frames.slice(1).map((ms, i) => ms - frames[i]);
  return { work, gaps, long: long.length };
}

/** Chooses the line that the inspector pretends. */
function choose(page, line) {
  return page.evaluate((name) => {
    const select = document.querySelector(".line select");
    select.value = name;
    select.onchange();
  }, line);
}

/** In the page: leaves out what a rasteriser would do, which without a graphics card is most of all work. */
function leaveOutPictures() {
  const calls = ["drawArrays", "drawArraysInstanced", "drawElements", "drawElementsInstanced", "drawRangeElements"];
  for (const call of calls) WebGL2RenderingContext.prototype[call] = () => {};
}

/** Notes the tasks of all threads; answers how to end that, which answers the events. */
async function trace(browser) {
  const devtools = await browser.newBrowserCDPSession();
  const events = [];
  devtools.on("Tracing.dataCollected", ({ value }) => {
    for (const event of value) if (event.name === "RunTask" || event.name === "thread_name") events.push(event);
  });
  const traceConfig = { includedCategories: ["disabled-by-default-devtools.timeline"], excludedCategories: ["*"] };
  await devtools.send("Tracing.start", { transferMode: "ReportEvents", traceConfig });
  return async () => {
    const complete = new Promise((done) => devtools.once("Tracing.tracingComplete", done));
    await devtools.send("Tracing.end");
    await complete;
    await devtools.detach();
    return events;
  };
}

class Tour {
  legs = [];

  constructor(page, devtools, run) {
    Object.assign(this, { page, devtools, run });
  }

  /** Does something for so long, and remembers what the main thread did. Samples of `notes` from before do not count. */
  async leg(name, seconds, act) {
    const { devtools, page } = this;
    const traced = await trace(page.context().browser());
    await devtools.send("Profiler.start");
    const arrives = this.legs.length === 0;
    // To begin a profile takes a while, which is not the page's.
    const start_ms = arrives
      ? 0
      : await page.evaluate(
          () => new Promise((go) => requestAnimationFrame(() => setTimeout(() => go(performance.now())))),
        );
    await act(seconds);
    const end_ms = await page.evaluate(() => performance.now());
    const { profile } = await devtools.send("Profiler.stop");
    const ran = tasksOf(await traced());
    const { metrics } = await devtools.send("Performance.getMetrics");
    const origin_s = metrics.find((one) => one.name === "NavigationStart").value;
    const notes = await page.evaluate(() => window.notes);
    const within = (ms) => ms >= start_ms && ms <= end_ms;
    const frames = notes.frames.filter(within);
    const spans = frames.slice(1).map((ms, i) => ({ start_ms: frames[i], end_ms: ms }));
    const long = notes.long.filter(([ms]) => within(ms) && ms > BEGUN_MS);
    const samples = samplesOf(profile, ran, origin_s);
    const tasks = long.map(([ms, duration]) => ({ start_ms: ms, end_ms: ms + duration }));
    const unready = (await page.evaluate(() => window.unready)).filter(within).length;
    this.legs.push({ name, unready, spans, frames: spent(samples, spans), tasks, long: spent(samples, tasks) });
    if (!values.save) return;
    mkdirSync(values.save, { recursive: true });
    const file = `${this.run}-${this.legs.length}-${name}.cpuprofile`
      .replace(/\W+/g, "-")
      .replace("-cpuprofile", ".cpuprofile");
    writeFileSync(join(values.save, file), JSON.stringify(profile));
    writeFileSync(
      join(values.save, `${file}.notes.json`),
      JSON.stringify({ ...notes, start_ms, end_ms, origin_s, ran }),
    );
  }

  /** Walks on, and turns wherever that ends. */
  async walk(seconds) {
    await this.page.evaluate(
      async ({ ms, walk_m, turn_rad }) => {
        const { belvedere } = window;
        for (const end = performance.now() + ms; performance.now() < end; ) {
          await Promise.race([
            belvedere.walk(walk_m),
            new Promise((over) => setTimeout(over, end - performance.now())),
          ]);
          const { position, yaw } = belvedere.state();
          belvedere.teleport(position, yaw + turn_rad);
        }
      },
      { ms: 1000 * seconds, walk_m: WALK_M, turn_rad: TURN_RAD },
    );
  }

  async fly(seconds, target) {
    await this.page.keyboard.press("f");
    await this.page.evaluate(
      async ({ ms, to, mps }) => {
        const over = new Promise((end) => setTimeout(end, ms));
        await Promise.race([window.belvedere.walkTo(to, mps), over]);
        await over;
      },
      { ms: 1000 * seconds, to: target, mps: FLY_MPS },
    );
    await this.page.keyboard.press("f");
  }

  async jump(seconds, viewpoint) {
    await this.page.evaluate(
      async ({ ms, number }) => {
        const select = document.querySelector("#viewpoints");
        select.value = String(number);
        select.onchange?.();
        await new Promise((over) => setTimeout(over, ms));
      },
      { ms: 1000 * seconds, number: viewpoint },
    );
  }
}

async function viewpoints() {
  const get = async (path) => (await fetch(new URL(path, base))).json();
  const { manifest } = await get(`/v1/scenes/${scene}/index.json`);
  return (await get(manifest)).viewpoints;
}

async function go(browser, origin, { name: run, line, rasterises }, places) {
  const context = await browser.newContext(DESKTOP);
  const page = await context.newPage();
  await page.addInitScript(takeNotes);
  await page.addInitScript(watchPrograms);
  if (!rasterises) await page.addInitScript(leaveOutPictures);
  const devtools = await context.newCDPSession(page);
  await devtools.send("Performance.enable");
  await devtools.send("Profiler.enable");
  await devtools.send("Profiler.setSamplingInterval", { interval: SAMPLE_US });
  const machine = [await calibrate(page, origin)];
  const tour = new Tour(page, devtools, run);
  const address = new URL(`${origin}/`);
  address.searchParams.set("base", new URL("/", base).href);
  address.searchParams.set("scene", scene);
  await tour.leg("arrive", ARRIVE_S, async (seconds) => {
    await page.goto(address.href);
    await page.waitForFunction(() => window.belvedere);
    await choose(page, line);
    await page.waitForTimeout(1000 * seconds);
  });
  for (const i of places.keys()) {
    const next = places[(i + 1) % places.length];
    await tour.leg("jump", LEG_S, (seconds) => tour.jump(seconds, i));
    await tour.leg("walk", LEG_S, (seconds) => tour.walk(seconds));
    await tour.leg("fly on", LEG_S, (seconds) => tour.fly(seconds, next.position));
  }
  const state = await page.evaluate(() => window.belvedere.state());
  machine.push(await calibrate(page, origin));
  await context.close();
  return { run, machine, legs: tour.legs, state };
}

const number = (ms) => ms.toFixed(1);
const row = (cells) => console.log(`| ${cells.join(" | ")} |`);
const quantiles = (numbers) => Object.values(SHARES).map((share) => number(quantile(numbers, share)));

function table({ run, machine, legs, state }) {
  console.log();
  row([`${scene}, ${run}`, "frames", ...Object.keys(SHARES), `over ${GOAL_MS} ms`]);
  row(["---", "---", ...Object.keys(SHARES).map(() => "---"), "---"]);
  const share = (numbers) =>
    `${((100 * numbers.filter((ms) => ms > GOAL_MS).length) / Math.max(1, numbers.length)).toFixed(1)} %`;
  const add = (name, numbers) => row([name, numbers.length, ...quantiles(numbers), share(numbers)]);
  for (const part of new Set(legs.map(({ name }) => name))) {
    const same = legs.filter(({ name }) => name === part).flatMap((leg) => leg.frames);
    add(
      part,
      same.map(({ streaming }) => streaming.ms),
    );
  }
  const frames = legs.flatMap((leg) => leg.frames);
  for (const kind of KINDS)
    add(
      `all: ${kind}`,
      frames.map((sums) => sums[kind].ms),
    );
  add(
    "all: streaming and garbage",
    frames.map(({ streaming, garbage }) => streaming.ms + garbage.ms),
  );
  add(
    "all: a frame",
    legs.flatMap(({ spans }) => spans.map(({ start_ms, end_ms }) => end_ms - start_ms)),
  );
  for (const [i, { work, gaps, long }] of machine.entries()) {
    add(`idle page ${i === 0 ? "before" : "after"}: a known piece of work`, work);
    add(`… a frame (${long} long tasks)`, gaps);
  }
  const over = frames.map(({ streaming }) => streaming).filter(({ ms }) => ms > GOAL_MS);
  console.log(`\nWhat ran in frames with more than ${GOAL_MS} ms of streaming:`);
  for (const [place, ms] of most(over, 25)) console.log(`  ${number(ms).padStart(8)} ms  ${place}`);
  const tasks = legs.flatMap(({ name, tasks, long }) => tasks.map((task, i) => ({ name, ...task, sums: long[i] })));
  const total_ms = ({ sums }) => KINDS.reduce((sum, kind) => sum + sums[kind].ms, 0);
  const isMost = (kind) => (task) => KINDS.every((other) => task.sums[kind].ms >= task.sums[other].ms);
  const unready = legs.reduce((sum, leg) => sum + leg.unready, 0);
  console.log(`\nPrograms that were drawn with before they were ready: ${unready}`);
  console.log(`Tasks of more than ${LONG_MS} ms after the first second: ${tasks.length}`);
  console.log(`  of these in CPU time: ${tasks.filter((task) => total_ms(task) > LONG_MS).length}`);
  for (const kind of KINDS) {
    const longest_ms = Math.max(0, ...tasks.map(({ sums }) => sums[kind].ms));
    console.log(
      `  mostly ${kind}: ${tasks.filter(isMost(kind)).length}; most of that in one: ${number(longest_ms)} ms`,
    );
  }
  console.log("Those with most streaming:");
  const byStreaming = [...tasks].sort((a, b) => b.sums.streaming.ms - a.sums.streaming.ms);
  for (const { name, start_ms, end_ms, sums } of byStreaming.slice(0, 8)) {
    const shares = KINDS.map((kind) => `${kind} ${number(sums[kind].ms)}`).join(", ");
    const places = most([sums.streaming], 3).map(([place, ms]) => `${place} ${number(ms)}`);
    console.log(`  ${number(end_ms - start_ms).padStart(7)} ms  ${name}: ${shares} (${places.join(", ")})`);
  }
  const { visible, missing, holes, triangles, drawCalls, problems } = state;
  console.log(`\nAt the end: ${JSON.stringify({ visible, missing, holes, triangles, drawCalls, problems })}`);
}

const folder = mkdtempSync(join(tmpdir(), "frames-"));
let [server, browser] = [];
try {
  await buildTo(folder);
  writeFileSync(join(folder, "idle.html"), "<!doctype html><title>idle</title>");
  server = await preview({
    configFile: false,
    appType: "mpa",
    logLevel: "error",
    build: { outDir: folder },
    preview: { port: 0, host: "127.0.0.1" },
  });
  browser = await launch();
  const places = await viewpoints();
  const origin = `http://127.0.0.1:${server.httpServer.address().port}`;
  for (const run of runs) table(await go(browser, origin, run, places));
} finally {
  await browser?.close();
  await server?.close();
  rmSync(folder, { recursive: true });
}
