/**
 * Can a page have more worlds than a browser has graphics contexts? Shows more of them than may draw at once, scrolls from the first to the
 * last and back: what is in view draws, what gave its room away shows its last picture, and is where it was when it draws again.
 * Environment: see `browser.mjs`.
 */
import { insist, picture, tell, timeout, url } from "./browser.mjs";

const [WORLDS, DRAWING] = [10, 8];

/** What each element is at: it draws, shows a picture, or shows an empty one. */
const states = (page) =>
  page.evaluate(() =>
    [...document.querySelectorAll("belvedere-scene")].map((one) => {
      const [first] = one.shadowRoot.querySelectorAll("canvas");
      if (!first.classList.contains("poster")) return "draws";
      const { data } = first.getContext("2d").getImageData(0, 0, first.width, first.height);
      return data.some((value) => value > 0) ? "picture" : "empty";
    }),
  );

/** Scrolls to one of them, and waits until the browser has told who is in view. */
const scrollTo = (page, number) =>
  page.evaluate(async (i) => {
    document.querySelectorAll("belvedere-scene")[i].scrollIntoView();
    for (let frame = 0; frame < 3; frame += 1) await new Promise(requestAnimationFrame);
  }, number);

/** Waits until one of them has a first picture. */
const ready = (page, number) =>
  page.waitForFunction((i) => window.ready.has(document.querySelectorAll("belvedere-scene")[i]), number, { timeout });

await tell("embeds", async (open) => {
  const page = await open();
  const warnings = [];
  page.on("console", (message) => /WebGL context/i.test(message.text()) && warnings.push(message.text()));
  await page.goto(new URL("embed/example.html", url).href);
  await page.evaluate(
    ([src, count]) => {
      window.ready = new Set();
      const worlds = Array.from({ length: count }, () => document.createElement("belvedere-scene"));
      for (const world of worlds) {
        world.style = "width: 96px; height: 54px; margin-bottom: 600px";
        world.src = src;
        world.addEventListener("ready", () => window.ready.add(world));
      }
      document.body.replaceChildren(...worlds);
    },
    [`../${new URL(url).search}`, WORLDS],
  );
  const draw = (all) => all.filter((one) => one === "draws").length;
  await ready(page, 0);
  insist(draw(await states(page)) === DRAWING, `at first it is ${await states(page)}`);
  const moved = await page.evaluate(() => {
    const first = document.querySelector("belvedere-scene");
    const { position, yaw } = first.pose;
    first.pose = { position, yaw: yaw + 1 };
    window.ready.delete(first);
    return first.pose;
  });
  // Past all that draw, so that the first has been out of view for longest.
  for (let i = 1; i < DRAWING; i += 1) await scrollTo(page, i);
  await scrollTo(page, WORLDS - 1);
  await ready(page, WORLDS - 1);
  const below = await states(page);
  insist(below.at(-1) === "draws" && draw(below) === DRAWING, `below it is ${below}`);
  insist(below[0] === "picture", `who has made room does not show its last picture: ${below}`);
  await scrollTo(page, 0);
  await ready(page, 0);
  const back = await states(page);
  insist(back[0] === "draws" && draw(back) === DRAWING, `above again it is ${back}`);
  const again = await page.evaluate(() => document.querySelector("belvedere-scene").pose);
  insist(JSON.stringify(again) === JSON.stringify(moved), "who draws again is elsewhere");
  insist(warnings.length === 0, `the browser took contexts away: ${warnings[0]}`);
  await page.screenshot({ path: picture("embeds") });
  console.log("a page shows more worlds than may draw at once");
});
