/**
 * Does a person get smooth LODs, and a picture without them where they are damaged? Looks at the first place with and
 * without them and compares bytes, spoils every stream, and comes back to a world that this browser has kept. Environment:
 * see `browser.mjs`; the scene must have smooth LODs. Where no bundles are offered, requests are dear and rungs few, so there
 * need not be one in sight to click.
 */
import { click, insist, picture, sharp, tell, timeout, until, url } from "./browser.mjs";

const isRung = (grade) => grade.startsWith("r");
/** Pointers are never kept; and what costs nothing any more may be chosen where something else was before. */
const FETCHED_AGAIN = 0.05;

function address(smooth) {
  const at = new URL(url);
  if (smooth === "off") at.searchParams.set("smooth", "off");
  return at.href;
}

/** The first visible object that the inspector shows with this text in its ladder or below it. */
async function findInLadder(page, pattern) {
  for (let y = 150; y < 650; y += 40) {
    for (let x = 40; x < 850; x += 40) {
      await click(page, x, y);
      const told = await page.evaluate(() =>
        ["ladder", "ladder-note"].map((id) => document.querySelector(`[data-testid=${id}]`)?.textContent).join(" "),
      );
      if (pattern.test(told ?? "")) return true;
    }
  }
  return false;
}

async function inspect(page, pattern, shot) {
  await page.locator("#view").focus();
  await page.keyboard.press("KeyI");
  await page.getByRole("complementary", { name: "Inspector" }).waitFor();
  const found = await findInLadder(page, pattern);
  await page.getByTestId("ladder-note").scrollIntoViewIfNeeded();
  await page.screenshot({ path: picture(shot) });
  insist(found, `no object in sight is said to be ${pattern}`);
}

async function withAndWithout(open) {
  const without = await open();
  await without.goto(address("off"));
  const levels = await sharp(without, "the place in levels");
  insist(!Object.keys(levels.levelsHeld).some(isRung), "rungs are held though smooth LODs are off");
  await without.screenshot({ path: picture("smooth-off") });
  await without.close();
  const page = await open();
  await page.goto(address("on"));
  const smooth = await sharp(page, "the place");
  const rungs = Object.entries(smooth.levelsHeld).filter(([grade]) => isRung(grade));
  insist(rungs.length > 0, "no smooth LOD is drawn");
  // Others grow rules and keep files.
  const decoders = page.workers().filter((worker) => worker.url().includes("smoothworker"));
  insist(decoders.length === 1, `${decoders.length} workers decode smooth LODs`);
  insist(smooth.bytesFetched < levels.bytesFetched, `smooth LODs take ${smooth.bytesFetched} bytes, more than levels`);
  await page.screenshot({ path: picture("smooth") });
  if (smooth.bundled > 0) await inspect(page, /rung \d+[^r]*drawn/, "smooth-ladder");
  const models = rungs.reduce((sum, [, count]) => sum + count, 0);
  return `${models} models by rungs: ${smooth.bytesFetched} bytes instead of ${levels.bytesFetched}`;
}

/** Turns a bit of each part of a smooth LOD in an answer, which may be a bundle; answers how many there are. */
function spoil(path, body) {
  const names = path.split("/").at(-1).split("+");
  const isBundle = path.includes("/bundle/");
  const table = isBundle ? 8 + 4 * names.length : 0;
  const end = (i) => table + (isBundle ? body.readUInt32LE(8 + 4 * i) : body.length);
  const parts = names.flatMap((name, i) => (name.endsWith(".slod") ? [i] : []));
  for (const i of parts) body[((i === 0 ? table : end(i - 1)) + end(i)) >> 1] ^= 8;
  return parts.length;
}

/** A wrong bit is noticed with the last rung at the latest; levels take its place. */
async function damaged(open) {
  const page = await open();
  let spoilt = 0;
  await page.route(/\.slod/, async (route) => {
    const response = await route.fetch();
    const body = await response.body();
    spoilt += spoil(new URL(route.request().url()).pathname, body);
    await route.fulfill({ response, body });
  });
  await page.goto(address("on"));
  await page.evaluate(() => {
    window.worstHoles = 0;
    setInterval(() => {
      window.worstHoles = Math.max(window.worstHoles, window.belvedere?.state().holes ?? 0);
    }, 50);
  });
  const now = await sharp(page, "the place with damaged streams");
  insist(spoilt > 0, "no rung was asked for");
  insist((await page.evaluate(() => window.worstHoles)) === 0, "something was held but not drawn");
  insist(now.notes.length > 0, "nothing is said of the damage");
  if (now.bundled > 0) await inspect(page, /the bytes that its name promises|is damaged/, "smooth-damaged");
  return `${spoilt} spoilt parts, ${now.visible} objects drawn all the same`;
}

/** Waits until what is kept for the next visit is written down. */
const kept = (page) => until(page, "what is kept is never written down", () => window.belvedere.state().keeping === 0);

async function again(open) {
  const page = await open();
  await page.goto(address("on"));
  const first = await sharp(page, "the first visit");
  // Some files are of use twice in one visit.
  insist(first.bytesKept < 0.1 * first.bytesFetched, `the first visit finds ${first.bytesKept} bytes kept`);
  await kept(page);
  await page.reload();
  const second = await sharp(page, "the second visit");
  insist(
    second.bytesFetched < FETCHED_AGAIN * first.bytesFetched,
    `the second visit fetches ${second.bytesFetched} bytes`,
  );
  insist(second.bytesKept > 0.5 * first.bytesFetched, `only ${second.bytesKept} bytes were kept`);
  await page.locator("#view").focus();
  await page.keyboard.press("KeyI");
  await page.getByTestId("clear-kept").scrollIntoViewIfNeeded();
  await page.screenshot({ path: picture("smooth-kept") });
  await page.getByTestId("clear-kept").click();
  await page.getByTestId("kept").getByText(", 0 objects").waitFor({ timeout });
  await kept(page);
  await page.reload();
  const third = await sharp(page, "the visit after clearing");
  insist(third.bytesKept < 0.1 * third.bytesFetched, `${third.bytesKept} bytes are there after clearing`);
  return `the second visit takes ${second.bytesFetched} bytes and ${second.requests} requests after ${first.bytesFetched} and ${first.requests}`;
}

await tell("smooth", async (open) => {
  for (const story of [withAndWithout, damaged, again]) console.log(await story(open));
});
