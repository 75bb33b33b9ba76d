/**
 * Does a walk that was recorded in the viewer lead where one went? Records by its key, walks by keys, looks around, rests, and
 * saves by the button in the inspector; the file must be what `belvedere walk --script` reads. With `BELVEDERE` the program
 * walks the same way again. Environment: see `browser.mjs`, and `BELVEDERE`, the program.
 */
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { frames, gone, insist, picture, settle, standing, state, tell, timeout, until, url } from "./browser.mjs";

/** A slow browser sees a frame every now and then only. */
const NEAR_M = 1e-3;
/** In these one rests. */
const MANY_FRAMES = 10;

function near(a, b) {
  return a.every((x, i) => Math.abs(x - b[i]) < NEAR_M);
}

/** What `belvedere walk --script` reads; of who was stopped within a tenth of a second, also after a rest, where that began and where it ended. */
function insistOnScript(text) {
  const lines = text.trimEnd().split("\n").map(JSON.parse);
  const rests = (a, b) => near(a.position, b.position) && near(a.orientation, b.orientation);
  const isShort = lines.length === 2 || (lines.length > 2 && rests(lines.at(-3), lines.at(-2)));
  insist(lines[0].t_ms === 0, `the script begins at ${lines[0].t_ms} ms`);
  for (const [i, { t_ms, position, orientation }] of lines.entries()) {
    const least_ms = isShort && i === lines.length - 1 ? 1 : 100;
    const isSpaced = i === 0 || t_ms - lines[i - 1].t_ms >= least_ms;
    insist(isSpaced, `pose ${i} comes ${t_ms - lines[i - 1]?.t_ms} ms after the one before`);
    insist(position.length === 3 && position.every(Number.isFinite), `pose ${i} is at ${position}`);
    insist(Math.abs(Math.hypot(...orientation) - 1) < 1e-3, `pose ${i} is turned by ${orientation}`);
  }
  return lines;
}

/** In the page: whether one has walked, or turned, for longer than it takes to take down a pose. */
function hasMoved({ position: [x, , z], yaw }) {
  const now = window.belvedere.state();
  return Math.hypot(now.position[0] - x, now.position[2] - z) > 0.5 || Math.abs(now.yaw - yaw) > 0.5;
}

await tell("recording", async (open) => {
  const page = await open();
  await page.goto(url);
  const start = await settle(page, "the first cell");
  await page.locator("#view").focus();
  await page.keyboard.press("KeyT");
  const stop = page.getByRole("button", { name: /Recording .*Stop and save/ });
  await stop.waitFor({ timeout });
  await page.waitForFunction(() => window.belvedere.recording.isRunning, undefined, { timeout });
  // One rests first, for a second of the recording.
  await stop.filter({ hasNotText: "0:00" }).waitFor({ timeout });
  for (const key of ["KeyW", "ArrowLeft", "KeyD"]) {
    const before = await state(page);
    await page.keyboard.down(key);
    await until(page, `${key} moves nobody`, hasMoved, before);
    await page.keyboard.up(key);
  }
  const end = await standing(page);
  await frames(page, MANY_FRAMES);
  await page.screenshot({ path: picture("recording") });
  await page.keyboard.press("KeyI");
  const button = page.getByTestId("record");
  await button.filter({ hasText: "Stop and save" }).waitFor({ timeout });
  const [download] = await Promise.all([page.waitForEvent("download", { timeout }), button.click()]);
  insist(download.suggestedFilename() === `${end.scene}-walk.jsonl`, `it is called ${download.suggestedFilename()}`);
  await gone(stop, "it says that it is still recording");
  const lines = insistOnScript(readFileSync(await download.path(), "utf8"));
  insist(near(lines[0].position, start.position), `it begins at ${lines[0].position}, not ${start.position}`);
  insist(near(lines.at(-1).position, end.position), `it ends at ${lines.at(-1).position}, not ${end.position}`);
  insist(lines.length > 2, `there are only ${lines.length} poses`);
  await page.evaluate(() => window.belvedere.recording.start());
  await frames(page, MANY_FRAMES);
  insistOnScript(await page.evaluate(() => window.belvedere.recording.stop()));
  const [only] = insistOnScript(
    await page.evaluate(() => {
      window.belvedere.recording.start();
      return window.belvedere.recording.stop();
    }),
  );
  insist(near(only.position, end.position), `what ends before a frame is at ${only.position}, not ${end.position}`);
  if (process.env.BELVEDERE) {
    const tree = new URL(url);
    const args = ["walk", tree.origin, "--scene", end.scene, "--script", await download.path(), "--json"];
    const walked = JSON.parse(execFileSync(process.env.BELVEDERE, args, { encoding: "utf8" }));
    const expected = Math.floor(lines.at(-1).t_ms / 100) + 1;
    insist(walked.frames === expected, `the program walks ${walked.frames} frames of ${expected}`);
  }
  console.log(`a walk of ${(lines.at(-1).t_ms / 1000).toFixed(1)} s was recorded with ${lines.length} poses`);
});
