/**
 * Can a page have more worlds than a browser has graphics contexts? Shows more of them than may draw at once, scrolls from the first to the
 * last and back: what is in view draws, what gave its room away shows its last picture, and is where it was when it draws again. Keys that went
 * to it still do, and what is out of view asks for no frames.
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

/** Which of them has the focus, and whether that is at what draws; −1 where none has. */
const focused = (page) =>
  page.evaluate(() => {
    const at = [...document.querySelectorAll("belvedere-scene")].indexOf(document.activeElement);
    const canvas = document.activeElement?.shadowRoot?.activeElement;
    return `${at} ${canvas?.classList.contains("poster") ? "poster" : canvas?.localName}`;
  });

/** Who is in a world goes on there by keys when it has made room for others, and when it draws again. */
async function keepFocus(page) {
  await scrollTo(page, 0);
  await page.locator("belvedere-scene canvas").first().focus();
  insist((await focused(page)) === "0 canvas", `the focus is at ${await focused(page)}`);
  for (let i = 1; i < WORLDS; i += 1) await scrollTo(page, i);
  insist((await states(page))[0] === "picture", `the first has not made room: ${await states(page)}`);
  insist((await focused(page)) === "0 poster", `the focus of who makes room is at ${await focused(page)}`);
  await page.evaluate(() => window.ready.clear());
  await scrollTo(page, 0);
  await ready(page, 0);
  insist((await focused(page)) === "0 canvas", `the focus of who draws again is at ${await focused(page)}`);
  const { yaw } = await page.evaluate(() => document.activeElement.pose);
  await page.keyboard.press("ArrowLeft");
  await page.waitForFunction((before) => document.activeElement.pose.yaw !== before, yaw, { timeout });
  // A picture is reached by keys, too, and then draws.
  const at = (await states(page)).findLastIndex((one) => one !== "draws");
  await page.evaluate((i) => {
    window.ready.clear();
    document.querySelectorAll("belvedere-scene")[i].focus();
  }, at);
  await ready(page, at);
  insist((await focused(page)) === `${at} canvas`, `the focus of who was reached by keys is at ${await focused(page)}`);
}

/** Frames are asked for by who is in view or has the focus alone. */
async function restOutOfView(page) {
  await page.evaluate(() => {
    document.activeElement.blur();
    const below = document.createElement("div");
    below.style = "height: 3000px";
    document.body.append(below);
    scrollTo(0, document.body.scrollHeight);
  });
  const asked = () => page.evaluate(() => window.asked);
  await page
    .waitForFunction(
      () => {
        const [before, since_ms] = window.quiet ?? [];
        if (before !== window.asked) window.quiet = [window.asked, performance.now()];
        return performance.now() - since_ms > 1000;
      },
      undefined,
      // Not by frames, which it would ask for itself.
      { timeout, polling: 100 },
    )
    .catch(async () => insist(false, `worlds out of view go on asking for frames: ${await asked()}`));
  const before = await asked();
  await scrollTo(page, 0);
  await page.waitForFunction((count) => window.asked > count + 10, before, { timeout, polling: 100 });
}

await tell("embeds", async (open) => {
  const page = await open();
  await page.addInitScript(() => {
    window.asked = 0;
    const ask = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (frame) => {
      window.asked += 1;
      return ask(frame);
    };
  });
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
  await keepFocus(page);
  await restOutOfView(page);
  console.log("a page shows more worlds than may draw at once");
});
