/**
 * Does the page draw without waiting for the graphics card? Walks, opens and closes a door, looks behind the picture with all that the
 * inspector draws, and meets people near and far, who wear a model or not, all of it with shadows: each program is compiled before anything
 * is drawn with it. And when the graphics card is lost, does the page say so, and draw again when it is back? `BELVEDERE_URL` names a
 * server that has the scenes `doored` and `square` (`e2e/worlds`); its first scene is walked through, too. Environment: see `browser.mjs`.
 */
import {
  addressOf,
  drawn,
  frames,
  insist,
  picture,
  settle,
  state,
  tell,
  timeout,
  until,
  url,
  watchPrograms,
} from "./browser.mjs";
import { enterDoored, objectCalled, removeMovers } from "./live.mjs";

const PEOPLE = 12;
/** In these what is here is drawn, and all that casts shadows. */
const MANY_FRAMES = 20;

/** Opens a page with shadows, by `enter` if that is given. */
async function begin(open, address, what, enter = (page, shaded) => page.goto(shaded)) {
  const page = await open();
  await page.addInitScript(watchPrograms);
  const shaded = new URL(address);
  shaded.searchParams.set("shadows", "on");
  await enter(page, shaded.href);
  await settle(page, what);
  return page;
}

/** Waits until all that is to be drawn is drawn by programs of its own. */
async function insistReady(page, when) {
  await drawn(page);
  await until(page, `${when}, a program is never compiled`, () => window.compiling() === 0);
  await frames(page, MANY_FRAMES);
  const unready = await page.evaluate(() => window.unready.splice(0));
  insist(unready.length === 0, `${when}, ${unready.length} programs were drawn with before they were compiled`);
}

const says = (page, sentence) =>
  page.waitForFunction(
    (pattern) => {
      const line = document.querySelector("#dark");
      return pattern === "" ? line.hidden : !line.hidden && new RegExp(pattern).test(line.textContent);
    },
    sentence,
    { timeout },
  );

/** Goes to each viewpoint, walks and looks round. */
async function walkThrough(page) {
  const viewpoints = await page.locator("#viewpoints option").count();
  for (let i = 0; i < Math.max(1, viewpoints - 1); i += 1) {
    await page.evaluate((number) => {
      const select = document.querySelector("#viewpoints");
      select.value = String(number);
      select.onchange?.();
    }, i);
    await settle(page, "a viewpoint");
    for (let turn = 0; turn < 3; turn += 1) {
      await page.evaluate(async () => {
        await window.belvedere.walk(2);
        const { position, yaw } = window.belvedere.state();
        window.belvedere.teleport(position, yaw + 2.1);
      });
    }
  }
}

/** Opens a door that is closed, and the reverse. */
async function useDoor(page) {
  const before = (await state(page)).closedDoors.length;
  const action = before === 0 ? "close" : "open";
  await page.locator("#door").filter({ hasText: action }).waitFor({ timeout });
  await page.keyboard.press("Enter");
  const isUsed = (count) => window.belvedere.state().closedDoors.length !== count;
  await until(page, `the door does not ${action}`, isUsed, before);
}

/** Shows each layer of the inspector, also while the view is frozen, cut off above and whole. */
async function lookBehind(page, what) {
  await page.keyboard.press("KeyI");
  const layers = page.locator("#inspector input[type=checkbox]");
  for (let i = 0; i < (await layers.count()); i += 1) await layers.nth(i).setChecked(true);
  await insistReady(page, `with the layers of ${what}`);
  await page.keyboard.press("KeyG");
  await insistReady(page, `with ${what} cut off above`);
  await page.screenshot({ path: picture(`graphics-${what}-cut`) });
  await page.keyboard.press("KeyG");
  await insistReady(page, `with ${what} whole again`);
  await page.keyboard.press("KeyI");
}

/** Moves somebody to and fro near the eye, and others far from it; every third wears the statue. */
async function people(page, address) {
  const statue = await objectCalled(page, address, "statue");
  const { position } = await state(page);
  const movers = new URL("/v1/scenes/square/movers", address);
  return Promise.all(
    Array.from({ length: PEOPLE }, async (_, i) => {
      const at = (x) => [position[0] + x, 1.65, position[2] - 2 - 3 * i];
      const key = (t_ms, x) => ({ t_ms, position: at(x), orientation: [0, 0, 0, 1] });
      const trajectory = { keys: [key(0, -1), key(2000, 1), key(4000, -1)], repeat: true };
      const data = { trajectory, ...(i % 3 === 0 ? { avatar: statue } : {}) };
      return (await page.request.post(movers.href, { data })).json();
    }),
  );
}

/** Takes the graphics card from the page, and gives it back. */
async function lose(page) {
  await page.evaluate(() => {
    window.card = document.querySelector("#view").getContext("webgl2").getExtension("WEBGL_lose_context");
    window.card.loseContext();
  });
  await says(page, "graphics card");
  await page.screenshot({ path: picture("graphics-lost") });
  await page.evaluate(() => window.card.restoreContext());
  await says(page, "");
}

/** Gives it back, and takes it again before all can be drawn. */
async function loseWhileItComesBack(page) {
  await page.evaluate(async () => {
    const canvas = document.querySelector("#view");
    const after = (event, work) => {
      const told = new Promise((tell) => canvas.addEventListener(event, tell, { once: true }));
      work();
      return told;
    };
    for (let i = 0; i < 2; i += 1) {
      await after("webglcontextlost", () => window.card.loseContext());
      await new Promise((over) => setTimeout(over));
      await after("webglcontextrestored", () => window.card.restoreContext());
    }
  });
  await says(page, "");
}

await tell("graphics", async (open) => {
  const first = await begin(open, url, "the first scene");
  await walkThrough(first);
  await insistReady(first, "in the first scene");
  await lookBehind(first, "first");
  await first.close();

  const doored = await begin(open, addressOf("doored"), "the rooms", enterDoored);
  await doored.evaluate(() => window.belvedere.teleport([4.5, 1.65, 3], -Math.PI / 2, 0));
  for (const _ of ["shut", "open"]) await useDoor(doored);
  await insistReady(doored, "at a door");
  await lookBehind(doored, "doored");
  await insistReady(doored, "with nothing behind the picture");
  const { drawCalls } = await state(doored);
  await lose(doored);
  await insistReady(doored, "by a graphics card that is back");
  const areDrawn = (calls) => window.belvedere.state().drawCalls === calls;
  await until(doored, `other draw calls follow ${drawCalls}`, areDrawn, drawCalls);
  await doored.close();

  const square = await begin(open, addressOf("square"), "the square");
  const made = await people(square, addressOf("square"));
  await square.waitForFunction((n) => window.belvedere.state().people.length >= n, PEOPLE, { timeout });
  await insistReady(square, "among people");
  await lookBehind(square, "square");
  await lose(square);
  await loseWhileItComesBack(square);
  await insistReady(square, "among people, by a graphics card that is back");
  await square.screenshot({ path: picture("graphics-square-back") });
  await removeMovers(square, made);
});
