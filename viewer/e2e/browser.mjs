/**
 * How does a test use a real browser? Opens the viewer at `BELVEDERE_URL` in headless Chromium, runs a story on the page
 * and ends with exit code 0, or 1 with a sentence. Screenshots go to `artifacts/`.
 *
 * Environment: `BELVEDERE_URL` (required), `CHROMIUM` (default `/usr/bin/chromium`), `ARTIFACTS` (default `artifacts`),
 * `BELVEDERE_TIMEOUT_S` (default 90, for each wait).
 */
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { chromium } from "playwright-core";

export const url = process.env.BELVEDERE_URL;
export const timeout = Number(process.env.BELVEDERE_TIMEOUT_S ?? 90) * 1000;
const artifacts = process.env.ARTIFACTS ?? "artifacts";
const FLAGS = [
  "--headless=new",
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--use-gl=angle",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
];
/** What has not moved for so long rests: who glides moves in each. */
const FRAMES_AT_REST = 3;
export const DESKTOP = { viewport: { width: 1280, height: 720 } };

export function insist(fact, sentence) {
  if (!fact) throw new Error(sentence);
}

/** The address of another scene on the same server, or on the one at `base`. */
export function addressOf(scene, base = url) {
  const address = new URL(base);
  address.searchParams.set("scene", scene);
  return address.href;
}

/** A browser that draws in software. */
export function launch() {
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: FLAGS });
}

/**
 * In a page, before anything else runs there: notes in `window.unready` when something is drawn with a program that is made in the same
 * task, or is not compiled yet, since who does that waits for it; `window.compiling()` answers how many are not compiled yet.
 */
export function watchPrograms() {
  const { linkProgram, useProgram } = WebGL2RenderingContext.prototype;
  const unused = new Map();
  const isCompiling = (gl, program) => {
    const parallel = gl.isProgram(program) && gl.getExtension("KHR_parallel_shader_compile");
    return parallel && !gl.getProgramParameter(program, parallel.COMPLETION_STATUS_KHR);
  };
  window.unready = [];
  window.compiling = () => [...unused].filter(([program, { gl }]) => isCompiling(gl, program)).length;
  WebGL2RenderingContext.prototype.linkProgram = function (program) {
    const made = { gl: this, isNew: true };
    unused.set(program, made);
    setTimeout(() => {
      made.isNew = false;
    });
    linkProgram.call(this, program);
  };
  WebGL2RenderingContext.prototype.useProgram = function (program) {
    const made = unused.get(program);
    if (made && (made.isNew || isCompiling(this, program))) window.unready.push(performance.now());
    unused.delete(program);
    useProgram.call(this, program);
  };
}

export const picture = (name) => join(artifacts, `${name}.png`);
export const state = (page) => page.evaluate(() => window.belvedere.state());

/** Waits until all that can be seen has at least its coarsest level; answers the state then. */
export async function settle(page, what) {
  let now;
  try {
    // Who moves on may have come to another cell before the state is read.
    do {
      await page.waitForFunction(() => window.belvedere?.state().settled, undefined, { timeout, polling: 100 });
      now = await state(page);
    } while (!now.settled);
  } catch {
    const problem = await page.locator("#problem-text").textContent();
    const last = await page.evaluate(() => JSON.stringify(window.belvedere?.state() ?? null));
    throw new Error(
      `${what} was not loaded within ${timeout / 1000} s. Page: ${problem || "no problem shown"}; ${last}`,
    );
  }
  insist(now.holes === 0, `${what}: ${now.holes} objects are held but not drawn`);
  insist(now.missing === 0, `${what}: ${now.missing} visible objects have no geometry`);
  return now;
}

/** Waits until a page is as a test wants it, else says `what`; not by frames, of which a page that nobody sees has none. */
export async function until(page, what, test, argument) {
  try {
    await page.waitForFunction(test, argument, { timeout, polling: 50 });
  } catch (error) {
    const last = await page.evaluate(() => JSON.stringify(window.belvedere?.state() ?? null));
    throw new Error(`${what}; ${last}; ${error.message}`);
  }
}

/** Waits until something is hidden, else says `what`. */
export function gone(locator, what) {
  return locator.waitFor({ state: "hidden", timeout }).catch(() => insist(false, what));
}

/** Clicks at a point of the page, and does not wait in between until it has heard of the press: what is held for long is no click. */
export async function click(page, x, y) {
  await page.mouse.move(x, y);
  await Promise.all([page.mouse.down(), page.mouse.up()]);
}

/** Waits for so many frames: what was done before has been taken up in them, and two of them show it. */
export async function frames(page, count = 2) {
  const left = await page.evaluateHandle((n) => ({ frames: n }), count);
  const isOver = (it) => {
    it.frames -= 1;
    return it.frames < 0;
  };
  await page.waitForFunction(isOver, left, { timeout });
}

/** Waits until what is read in a page is the same some frames later; answers it. */
export async function atRest(page, what, read, argument) {
  const end_ms = Date.now() + timeout;
  for (let now, before; ; before = now) {
    now = JSON.stringify(await page.evaluate(read, argument));
    if (now === before) return JSON.parse(now);
    insist(Date.now() < end_ms, `${what} does not come to rest: after ${before} it is ${now}`);
    await frames(page, FRAMES_AT_REST);
  }
}

/** Waits until all that was asked for is here and drawn. */
export async function drawn(page) {
  await until(page, "something stays on its way", () => window.belvedere.state().pending === 0);
  await frames(page);
}

/** Waits until one stands still; answers the state then. */
export async function standing(page) {
  await atRest(page, "who walks", () => {
    const { position, yaw, pitch } = window.belvedere.state();
    return [position, yaw, pitch];
  });
  return state(page);
}

/** Waits until one stands still and the address says where, as the page writes it; answers the state then. */
export async function addressed(page) {
  const there = await standing(page);
  await until(
    page,
    "the address does not say where one is",
    ({ position, yaw, pitch, mode }) => {
      const said = new URLSearchParams(location.hash.slice(1));
      const degrees = (angle) => ((angle * 180) / Math.PI).toFixed(2);
      const isThere = said.get("p") === position.map((x) => x.toFixed(3)).join(",");
      const isTurned = said.get("yaw") === degrees(yaw) && said.get("pitch") === degrees(pitch);
      return isThere && isTurned && (said.get("mode") ?? "walk") === mode;
    },
    there,
  );
  return there;
}

/**
 * Runs a story. It is given `open`, which makes a page of its own, with Playwright's options for it, in a browser that begins with the
 * first; nothing that it complains of on the console is forgiven, but for what matches `forgive`.
 */
export async function tell(name, story) {
  const complaints = [];
  const pages = [];
  let browser;
  try {
    insist(url, "set BELVEDERE_URL to the address of a viewer");
    mkdirSync(artifacts, { recursive: true });
    await story(async (options = DESKTOP, forgive = /^$/) => {
      browser ??= await launch();
      const page = await browser.newPage(options);
      page.setDefaultTimeout(timeout);
      page.on("console", (message) => {
        if (message.type() === "error" && !forgive.test(message.text())) complaints.push(message.text());
      });
      page.on("pageerror", (error) => complaints.push(String(error)));
      pages.push(page);
      return page;
    });
    insist(complaints.length === 0, `the console says: ${complaints.join("; ")}`);
  } catch (error) {
    for (const [i, page] of pages.entries()) {
      await page.screenshot({ path: picture(`failure-${name}-${i}`) }).catch(() => {});
    }
    console.error(`${name} failed: ${error.message}`);
    process.exitCode = 1;
  } finally {
    await browser?.close();
  }
}

/** Waits until nothing is on its way; answers the state then. */
export async function sharp(page, what) {
  await settle(page, what);
  await until(page, `${what}: something stays on its way`, () => window.belvedere.state().pending === 0);
  const now = await state(page);
  insist(now.problems.length === 0, `${what}: ${now.problems.join("; ")}`);
  return now;
}
