/**
 * Does a person with a real browser get through a door? Opens the viewer at `BELVEDERE_URL`, waits until the first cell
 * is loaded, walks through a portal and through the next one, and insists that the page shows the cell beyond, that the
 * number of visible objects is that of its record, that nothing was ever a hole and that nothing complained. Screenshots
 * go to `artifacts/`. Exit code 0, or 1 with a sentence.
 *
 * Environment: `BELVEDERE_URL` (required), `CHROMIUM` (default `/usr/bin/chromium`), `ARTIFACTS` (default `artifacts`),
 * `BELVEDERE_TIMEOUT_S` (default 90, for each wait).
 */
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { chromium } from "playwright-core";

const url = process.env.BELVEDERE_URL;
const artifacts = process.env.ARTIFACTS ?? "artifacts";
const timeout = Number(process.env.BELVEDERE_TIMEOUT_S ?? 90) * 1000;
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
/** Room for a walker beside the posts of a doorway. */
const PASSAGE_M = 0.6;

function insist(fact, sentence) {
  if (!fact) throw new Error(sentence);
}

const state = (page) => page.evaluate(() => window.belvedere.state());
const record = (page, cell) => page.evaluate((id) => window.belvedere.record(id), cell);

async function settle(page, what) {
  try {
    await page.waitForFunction(() => window.belvedere?.state().settled, undefined, { timeout, polling: 100 });
  } catch {
    const problem = await page.locator("#problem-text").textContent();
    const now = await page.evaluate(() => JSON.stringify(window.belvedere?.state() ?? null));
    throw new Error(
      `${what} was not loaded within ${timeout / 1000} s. Page: ${problem || "no problem shown"}; ${now}`,
    );
  }
  const now = await state(page);
  insist(now.holes === 0, `${what}: ${now.holes} objects are held but not drawn`);
  insist(now.missing === 0, `${what}: ${now.missing} visible objects have no geometry`);
  return now;
}

/** Where a walker passes a portal upright: its centre, when it is an upright opening that is wide enough. */
function passage(portal, eyeHeight) {
  const axis = (i) => portal.polygon.map((point) => point[i]);
  const size = (i) => Math.max(...axis(i)) - Math.min(...axis(i));
  const middle = (i) => (Math.max(...axis(i)) + Math.min(...axis(i))) / 2;
  const upright = Math.min(...axis(1)) < eyeHeight && eyeHeight < Math.max(...axis(1));
  const wide = Math.hypot(size(0), size(2)) >= PASSAGE_M && size(1) > 0.3;
  return upright && wide ? [middle(0), eyeHeight, middle(2)] : undefined;
}

/** A way through two portals into a cell from which another number of objects is visible, if there is one. */
async function chooseWay(page, from, eyeHeight) {
  const start = await record(page, from);
  const ways = [];
  for (const first of start.portals) {
    const a = passage(first, eyeHeight);
    if (!a) continue;
    const next = await record(page, first.to);
    for (const second of next.portals) {
      const b = passage(second, eyeHeight);
      if (!b || second.to === start.cell || Math.hypot(a[0] - b[0], a[2] - b[2]) < 0.05) continue;
      const beyond = await record(page, second.to);
      const middle = (i) => beyond.hull.points.reduce((sum, point) => sum + point[i], 0) / beyond.hull.points.length;
      const seen = (cell) => cell.opvs.length + cell.lpvs.length;
      ways.push({
        first: a,
        second: b,
        goal: [middle(0), eyeHeight, middle(2)],
        through: `c${first.to}`,
        to: `c${second.to}`,
        expected: seen(beyond),
        changes: seen(beyond) !== seen(start),
      });
    }
  }
  insist(ways.length > 0, `from ${from} no portal leads on to a second cell at eye height ${eyeHeight.toFixed(2)} m`);
  return ways.find((way) => way.changes) ?? ways[0];
}

/** Turns towards a point and holds W until the displayed cell changes. */
async function walkByKey(page, target, from) {
  const { position } = await state(page);
  const yaw = Math.atan2(-(target[0] - position[0]), -(target[2] - position[2]));
  await page.evaluate(([p, angle]) => window.belvedere.teleport(p, angle, 0), [position, yaw]);
  await page.locator("#view").focus();
  await page.keyboard.down("KeyW");
  try {
    await page.waitForFunction((cell) => window.belvedere.state().cell !== cell, from, { timeout, polling: 20 });
  } catch {
    throw new Error(`holding W did not lead out of ${from} towards ${target}`);
  } finally {
    await page.keyboard.up("KeyW");
  }
}

async function walkTo(page, target) {
  const arrived = await page.evaluate((point) => window.belvedere.walkTo(point, 2), target);
  const { position, cell } = await state(page);
  insist(arrived, `the walker is stuck at ${position} in ${cell} on the way to ${target}`);
}

async function walk(page, complaints) {
  await page.goto(url);
  const start = await settle(page, "the first cell");
  insist(start.cell !== null, "no cell is displayed");
  await page.screenshot({ path: join(artifacts, "1-start.png") });
  const way = await chooseWay(page, start.cell, start.position[1]);
  console.log(`walking ${start.cell} → ${way.through} → ${way.to}`);

  await walkByKey(page, way.first, start.cell);
  const between = await settle(page, "the cell behind the first portal");
  insist(between.cell === way.through, `expected ${way.through} behind the first portal, not ${between.cell}`);
  await page.screenshot({ path: join(artifacts, "2-doorway.png") });

  await walkTo(page, way.second);
  await walkTo(page, way.goal);
  const end = await settle(page, "the cell beyond");
  await page
    .waitForFunction((cell) => document.querySelector("[data-testid=cell]").textContent === cell, way.to, {
      timeout: 5000,
    })
    .catch(() => {});
  const shown = await page.getByTestId("cell").textContent();
  const visible = await page.getByTestId("visible").textContent();
  const bytes = await page.getByTestId("bytes").textContent();
  await page.screenshot({ path: join(artifacts, "3-beyond.png") });
  insist(shown === way.to, `the page shows ${shown} where ${way.to} is expected`);
  insist(end.cell === way.to, `the walker is in ${end.cell} where ${way.to} is expected`);
  const whole = start.visible === start.objects && end.visible === end.objects;
  const expected = whole ? end.objects : way.expected;
  insist(end.visible === expected, `${end.visible} objects are shown where the record of ${way.to} lists ${expected}`);
  insist(!way.changes || whole || end.visible !== start.visible, "the number of visible objects did not change");
  insist(visible.startsWith(`${end.visible} of ${end.objects} `), `the page says "${visible}"`);
  insist(/^[\d.]+ [kMG]?B of /.test(bytes), `the page says "${bytes}"`);
  insist(end.problems.length === 0, `the viewer reports: ${end.problems.join("; ")}`);
  insist(complaints.length === 0, `the console says: ${complaints.join("; ")}`);
  console.log(`arrived in ${shown}: ${visible}, ${bytes}`);
}

async function main() {
  insist(url, "set BELVEDERE_URL to the address of a viewer");
  mkdirSync(artifacts, { recursive: true });
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: FLAGS });
  const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
  const complaints = [];
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error)));
  try {
    await walk(page, complaints);
  } catch (error) {
    await page.screenshot({ path: join(artifacts, "failure.png") }).catch(() => {});
    throw error;
  } finally {
    await browser.close();
  }
}

main().catch((error) => {
  console.error(`the walk failed: ${error.message}`);
  process.exitCode = 1;
});
