/**
 * Does a walk that was recorded in the viewer lead where one went? Records by its key, walks by keys, looks around, rests, and
 * saves by the button in the inspector; the file must be what `belvedere walk --script` reads. With `BELVEDERE` the program
 * walks the same way again. Environment: see `browser.mjs`, and `BELVEDERE`, the program.
 */
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { insist, picture, settle, state, tell, timeout, url } from "./browser.mjs";

/** A slow browser sees a frame every now and then only. */
const NEAR_M = 1e-3;

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

/** Where one is and looks. */
async function pose(page) {
  const { position, yaw, pitch } = await state(page);
  return JSON.stringify([position, yaw, pitch]);
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
  await page.waitForTimeout(700);
  for (const key of ["KeyW", "ArrowLeft", "KeyD"]) {
    const before = await pose(page);
    await page.keyboard.down(key);
    await page.waitForTimeout(700);
    while ((await pose(page)) === before) await page.waitForTimeout(100);
    await page.keyboard.up(key);
  }
  await page.waitForTimeout(1200);
  await page.screenshot({ path: picture("recording") });
  const end = await state(page);
  await page.keyboard.press("KeyI");
  const button = page.getByTestId("record");
  await button.filter({ hasText: "Stop and save" }).waitFor({ timeout });
  const [download] = await Promise.all([page.waitForEvent("download", { timeout }), button.click()]);
  insist(download.suggestedFilename() === `${end.scene}-walk.jsonl`, `it is called ${download.suggestedFilename()}`);
  insist(await stop.isHidden(), "it says that it is still recording");
  const lines = insistOnScript(readFileSync(await download.path(), "utf8"));
  insist(near(lines[0].position, start.position), `it begins at ${lines[0].position}, not ${start.position}`);
  insist(near(lines.at(-1).position, end.position), `it ends at ${lines.at(-1).position}, not ${end.position}`);
  insist(lines.length > 2, `there are only ${lines.length} poses`);
  const again = await page.evaluate(() => {
    window.belvedere.recording.start();
    return new Promise((done) => setTimeout(() => done(window.belvedere.recording.stop()), 500));
  });
  insistOnScript(again);
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
