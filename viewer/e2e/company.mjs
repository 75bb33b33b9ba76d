/**
 * Do people meet? Two pages walk into the same world of two rooms, see each other move, and stop seeing each other when
 * one closes the door between them. `BELVEDERE_URL` names a server that has the scene `doored` (`e2e/worlds`);
 * `BELVEDERE_STATIC`, where given, a static tree of it, in which doors move too and nobody complains. Environment: see
 * `browser.mjs`.
 */
import { addressOf, atRest, click, insist, picture, state, tell, timeout, until, url } from "./browser.mjs";
import { enterDoored } from "./live.mjs";

const WEST = [2, 1.65, 3];
const EAST = [10, 1.65, 3];
const BEFORE_THE_DOOR = [3, 1.65, 3];

/** Longer than people walk on of whom nothing is heard. */
const UNHEARD_MS = 3000;

/** Enters the rooms, and opens the door if a walk that failed has left it closed. */
async function enter(page, base, position, yaw) {
  const isClosed = await enterDoored(page, addressOf("doored", base));
  if (isClosed) await openAgain(page);
  await page.evaluate(([p, angle]) => window.belvedere.teleport(p, angle, 0), [position, yaw]);
  return page;
}

const meets = (page, count) =>
  until(page, `${count} people are expected`, (n) => window.belvedere.state().people.length === n, count);

/** Looks at the door until it swings no more; answers where it can be clicked. */
async function look(page) {
  await page.evaluate(([p, angle]) => window.belvedere.teleport(p, angle, 0), [BEFORE_THE_DOOR, -Math.PI / 2]);
  await until(page, "the leaf of the door is not in the picture", () => window.belvedere.find("door:leaf"));
  return atRest(page, "the leaf of the door", () => window.belvedere.find("door:leaf"));
}

async function clickDoor(page) {
  const { x, y } = await look(page);
  await click(page, x, y);
}

/** Walks through the open door, closes it and bumps into it. */
async function closeDoor(page, name) {
  await look(page);
  await page.screenshot({ path: picture(`${name}-door-open`) });
  const through = await page.evaluate((p) => window.belvedere.walkTo(p, 2), EAST);
  insist(through, "nobody gets through the open door");
  await clickDoor(page);
  await until(page, "the door does not close", () => window.belvedere.state().closedDoors.length === 1);
  await look(page);
  await page.screenshot({ path: picture(`${name}-door-closed`) });
  const stopped = !(await page.evaluate((p) => window.belvedere.walkTo(p, 2), EAST));
  insist(stopped, "one walks through a closed door");
}

/** In a page, before anything runs there: lets a test stop frames, as a browser does for a page that nobody sees. */
function holdFrames() {
  const request = window.requestAnimationFrame.bind(window);
  let held;
  const run = (callback) => (now_ms) => (held ? held.push(callback) : callback(now_ms));
  window.requestAnimationFrame = (callback) => request(run(callback));
  window.hide = () => {
    held = [];
    Object.defineProperty(document, "hidden", { get: () => held !== undefined });
    document.dispatchEvent(new Event("visibilitychange"));
  };
  window.show = () => {
    const again = held;
    held = undefined;
    for (const callback of again) request(callback);
    document.dispatchEvent(new Event("visibilitychange"));
  };
}

/** Who turns to another page while walking stands there for others, too. */
async function turnAway(page, other) {
  await page.bringToFront();
  await page.locator("#view").focus();
  const from = (await state(page)).position;
  await page.keyboard.down("KeyD");
  await page.waitForFunction((z) => window.belvedere.state().position[2] > z + 0.4, from[2], { polling: 20, timeout });
  await page.evaluate(() => window.hide());
  await page.keyboard.up("KeyD");
  const stood = (await state(page)).position;
  await other.bringToFront();
  const isThere = ([x, , z]) => {
    const [seen] = window.belvedere.state().people;
    return seen !== undefined && Math.hypot(seen[0] - x, seen[2] - z) < 0.15;
  };
  await until(other, `who looked away at ${stood} is elsewhere for others`, isThere, stood);
  // Others let those walk on of whom they hear nothing, for two seconds; nothing tells that one does not.
  const since_ms = await other.evaluate(() => performance.now());
  const isOver = ([since, ms]) => performance.now() > since + ms;
  await other.waitForFunction(isOver, [since_ms, UNHEARD_MS], { timeout });
  insist(await other.evaluate(isThere, stood), `who looked away at ${stood} goes on without moving`);
  await page.evaluate(() => window.show());
}

async function openAgain(page) {
  await clickDoor(page);
  await until(page, "the door does not open", () => window.belvedere.state().closedDoors.length === 0);
}

await tell("company", async (open) => {
  const first = await open();
  await first.addInitScript(holdFrames);
  const ada = await enter(first, url, WEST, -Math.PI / 2);
  const bob = await enter(await open(), url, EAST, Math.PI / 2);
  await ada.bringToFront();
  await meets(ada, 1);
  await meets(bob, 1);
  const there = (await state(ada)).people[0];
  await bob.bringToFront();
  await bob.evaluate(() => window.belvedere.walkTo([10, 1.65, 4.5], 2));
  await ada.bringToFront();
  await until(ada, "the other does not move", (z) => window.belvedere.state().people[0]?.[2] > z + 1, there[2]);
  await ada.screenshot({ path: picture("company-met") });
  await turnAway(ada, bob);
  await ada.bringToFront();
  await closeDoor(ada, "company");
  // Who stands at the door may be through it before the server hears of it.
  await ada.evaluate((p) => window.belvedere.walkTo(p, 2), WEST);
  await meets(ada, 0);
  await bob.bringToFront();
  await until(bob, "the door is open for the other", () => window.belvedere.state().closedDoors.length === 1);
  await meets(bob, 0);
  await ada.bringToFront();
  await openAgain(ada);
  await meets(ada, 1);
  console.log("two people met, a door parted them, and it opened again");
  const tree = process.env.BELVEDERE_STATIC;
  if (!tree) return;
  const alone = await enter(await open(), tree, WEST, -Math.PI / 2);
  await closeDoor(alone, "static");
  await openAgain(alone);
  console.log("in a static tree doors move for oneself");
});
