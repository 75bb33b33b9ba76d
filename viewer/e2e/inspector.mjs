/**
 * Does the inspector show what is behind the picture? Opens it by its key, compares what it says with what the page
 * knows, freezes the view, flies out and comes back, picks an object and pretends that the line is slow. Environment: see
 * `browser.mjs`.
 */
import { click, drawn, frames, gone, insist, picture, settle, state, tell, timeout, until, url } from "./browser.mjs";

/** More of it than may come before the line is slow. */
const MEASURED_BYTES = 14_000;

const text = (page, id) => page.getByTestId(id).textContent();

async function says(page, id, pattern) {
  try {
    await page.waitForFunction(
      ([name, source]) => new RegExp(source).test(document.querySelector(`[data-testid=${name}]`)?.textContent ?? ""),
      [id, pattern.source],
      { timeout },
    );
  } catch {
    throw new Error(`"${id}" says "${await text(page, id)}" where ${pattern} is expected`);
  }
}

async function freeze(page) {
  const before = await state(page);
  await page.keyboard.press("KeyG");
  await says(page, "saved", /objects are hidden/);
  const after = await state(page);
  const told = await text(page, "saved");
  const [hidden, absent, here = 0] = (
    told.match(/^(\d+) of .*Nothing of (\d+) of them.*?(?:models of (\d+) are here|Fly)/) ?? []
  )
    .slice(1)
    .map((number) => Number(number ?? 0));
  insist(hidden === absent + here, `hidden objects do not add up: "${told}"`);
  const expected = before.objects - before.visible;
  insist(hidden === expected, `${hidden} objects are said to be hidden where ${expected} are`);
  insist(after.cell === before.cell, "the cell changed while the view was frozen");
  insist(after.position[1] > before.position[1] + 5, "one does not look from above at a frozen view");
  await page.keyboard.down("KeyW");
  const flies = (from) => Math.hypot(...window.belvedere.state().position.map((x, i) => x - from[i])) > 1;
  await until(page, "one does not fly about a frozen view", flies, after.position);
  await page.keyboard.up("KeyW");
  await frames(page);
  insist((await state(page)).visible === before.visible, "what is visible changed while the view was frozen");
  await page.screenshot({ path: picture("inspector-frozen") });
  await page.getByText("Cells next door").click();
  await page.getByText("Visible: inside").click();
  await drawn(page);
  await page.screenshot({ path: picture("inspector-layers") });
  await page.locator("#view").focus();
  await page.keyboard.press("KeyG");
  const back = await state(page);
  insist(String(back.position) === String(before.position), "the way back does not lead to where the view was frozen");
  insist(back.mode === before.mode, `one comes back in mode ${back.mode}`);
}

/** Waits until all of the inspector was brought up to date: then it says anew what its chart shows. */
async function updated(page) {
  await page.evaluate(() => {
    window.isUpdated = false;
    const note = () => {
      window.isUpdated = true;
    };
    new MutationObserver(note).observe(document.querySelector("#inspector canvas"), { attributes: true });
  });
  await until(page, "the inspector stays as it is", () => window.isUpdated);
}

/** Who reads the table of an object, cell by cell, is not thrown out of it while it says the same; and parts of the inspector have headings. */
async function readAloud(page) {
  await drawn(page);
  await updated(page);
  const table = page.getByRole("table", { name: "How it can be drawn" });
  const cell = await table.getByRole("rowheader").first().elementHandle();
  await updated(page);
  insist(await cell.evaluate((it) => it.isConnected), "a table that says the same is made anew");
  const parts = await page.locator("#inspector").getByRole("heading", { level: 3 }).count();
  insist(parts === 7, `${parts} parts of the inspector have headings`);
}

async function pretendSlowLine(page) {
  await page.getByLabel("Pretend that the line is").selectOption("56k");
  const started = await state(page);
  await page.evaluate(() => {
    const [x, y, z] = window.belvedere.state().position;
    window.belvedere.teleport([x + 25, y, z + 20]);
  });
  await until(page, "one stays in a cell", (cell) => window.belvedere.state().cell !== cell, started.cell);
  const measure = () => page.evaluate(() => [window.belvedere.state().bytesFetched, performance.now()]);
  const [from, from_ms] = await measure();
  const hasCome = (least) => window.belvedere.state().bytesFetched >= least || window.belvedere.state().pending === 0;
  await until(page, "nothing comes on a slow line", hasCome, from + MEASURED_BYTES);
  const [to, to_ms] = await measure();
  await page.screenshot({ path: picture("inspector-slow") });
  const rate = (8000 * (to - from)) / (to_ms - from_ms);
  // Bytes are counted in pieces, and cached ones before they are slowed down.
  insist(rate < 4 * 56_000, `${Math.round(rate / 1000)} kb/s arrive on a line of 56`);
  await page.getByLabel("Pretend that the line is").selectOption("");
  await settle(page, "the other place");
  await keepsSlowLine(page);
}

/** The line stays slow over a reload, as when another scene is chosen, until another line is. */
async function keepsSlowLine(page) {
  const line = page.getByLabel("Pretend that the line is");
  for (const name of ["56k", ""]) {
    await line.selectOption(name);
    await page.reload();
    await settle(page, "the place before a reload");
    await page.locator("#view").focus();
    await page.keyboard.press("KeyI");
    const kept = await line.inputValue();
    insist(kept === name, `after a reload the line is "${kept}" where "${name}" was chosen`);
  }
}

/** Reasons are there to be read, without a mouse too, also those of a while ago. */
async function readRequests(page) {
  const list = page.getByTestId("requests");
  const isLong = () => document.querySelectorAll("[data-testid=requests] li").length > 20;
  await until(page, "few requests are listed", isLong);
  const clipped = await list.evaluate(
    (ol) =>
      [...ol.querySelectorAll("span:not(.when)")].filter((cell) => cell.scrollWidth > cell.clientWidth + 1).length,
  );
  insist(clipped === 0, `${clipped} texts of requests are cut off`);
  const read = await list.locator(".why").allTextContents();
  insist(read.every(Boolean), "a request does not say why it was made");
  await list.focus();
  await page.keyboard.press("End");
  await page.waitForFunction(
    (ol) => {
      const last = ol.lastElementChild.getBoundingClientRect();
      return ol.scrollTop > 0 && last.bottom <= ol.getBoundingClientRect().bottom + 1;
    },
    await list.elementHandle(),
    { timeout },
  );
  await frames(page);
  await page.screenshot({ path: picture("inspector-requests") });
}

/** What has a colour of its own to be known by must keep it where the system sets all others. */
async function forceColours(page) {
  await page.emulateMedia({ forcedColors: "active" });
  const legends = await page.evaluate(() =>
    [...document.querySelectorAll("#inspector :is(.legend, .toggle)")]
      .map((legend) =>
        [...legend.querySelectorAll(".swatch")].map((swatch) => getComputedStyle(swatch).backgroundColor),
      )
      .filter((colours) => colours.length > 1),
  );
  insist(legends.length >= 3, `only ${legends.length} legends have colours`);
  for (const colours of legends) {
    insist(new Set(colours).size === colours.length, `where colours are forced, a legend shows ${colours.join()}`);
  }
  await page.screenshot({ path: picture("inspector-forced-colours") });
  await page.emulateMedia({ forcedColors: null });
}

await tell("inspector", async (open) => {
  const page = await open();
  await page.goto(url);
  const start = await settle(page, "the first cell");
  await page.locator("#view").focus();
  await page.keyboard.press("KeyI");
  await page.getByRole("complementary", { name: "Inspector" }).waitFor();
  await says(page, "memory", /held, .+ promised, limit .+; \d+ models/);
  await drawn(page);
  await page.screenshot({ path: picture("inspector") });
  await readRequests(page);
  await forceColours(page);
  if (start.visible < start.objects) await freeze(page);
  await click(page, 500, 400);
  await says(page, "picked", /^o\d+ “.*”, model m\d+/);
  await readAloud(page);
  await pretendSlowLine(page);
  await page.locator("#view").focus();
  await page.keyboard.press("KeyI");
  await gone(page.locator("#inspector"), "the inspector does not close");
  const end = await state(page);
  insist(end.problems.length === 0, `the viewer reports: ${end.problems.join("; ")}`);
  console.log(`the inspector tells of ${start.visible} visible and ${start.objects - start.visible} hidden objects`);
});
