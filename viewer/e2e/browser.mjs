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
 * task, or is not compiled yet, since who does that waits for it.
 */
export function watchPrograms() {
  const { linkProgram, useProgram } = WebGL2RenderingContext.prototype;
  const unused = new Map();
  window.unready = [];
  WebGL2RenderingContext.prototype.linkProgram = function (program) {
    unused.set(program, "made");
    setTimeout(() => unused.has(program) && unused.set(program, "asked for"));
    linkProgram.call(this, program);
  };
  WebGL2RenderingContext.prototype.useProgram = function (program) {
    const parallel = unused.has(program) && this.getExtension("KHR_parallel_shader_compile");
    const isUnready = parallel && !this.getProgramParameter(program, parallel.COMPLETION_STATUS_KHR);
    if (unused.get(program) === "made" || isUnready) window.unready.push(performance.now());
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
