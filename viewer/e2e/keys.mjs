/**
 * Can one walk without a mouse? Walks up to a door with keys alone, closes and opens it with Enter, with a gamepad and with its
 * button, looks up and down, flies, asks for help, and listens to what a screen reader is told. `BELVEDERE_URL` names a tree that
 * has the scene `doored` (`e2e/worlds`). Environment: see `browser.mjs`.
 */
import {
  addressOf,
  atRest,
  click,
  drawn,
  frames,
  gone,
  insist,
  picture,
  state,
  tell,
  timeout,
  until,
  url,
} from "./browser.mjs";
import { enterDoored } from "./live.mjs";

/** In these a gamepad is looked at many times. */
const MANY_FRAMES = 10;
/** Longer than a page is quiet before it speaks. */
const SPOKEN_AFTER_MS = 1000;
/** Where the door is in reach. */
const NEAR = [3.5, 1.65, 3];

const closed = (page, count) =>
  until(page, `${count} closed doors are expected`, (n) => window.belvedere.state().closedDoors.length === n, count);

/** In a page, before anything else runs there: notes in `window.heard` what a screen reader is told, one thing after the other. */
function listen() {
  window.heard = [];
  addEventListener("DOMContentLoaded", () => {
    const line = document.querySelector("#live");
    const note = () => window.heard.push(line.textContent);
    new MutationObserver(note).observe(line, { childList: true, characterData: true, subtree: true });
  });
}

/** Waits until something is said, if it was not since what was heard last. */
const hear = (page, pattern) =>
  until(
    page,
    `nobody hears ${pattern}`,
    (source) => {
      const at = window.heard.findIndex((line) => new RegExp(source).test(line));
      window.heard.splice(0, at);
      return at >= 0;
    },
    pattern.source,
  );

/** Holds a key until the page is in a state. */
async function hold(page, key, what, test, argument) {
  await page.keyboard.down(key);
  try {
    await until(page, `holding ${key}: ${what}`, test, argument);
  } finally {
    await page.keyboard.up(key);
  }
}

/** From the wall behind one to the door, in a live session or alone. */
async function throughTheDoor(page) {
  const isClosed = await enterDoored(page, `${addressOf("doored")}#p=1,1.65,3&yaw=0&pitch=0`);
  await drawn(page);
  insist(await page.locator("#door").isHidden(), "a door is offered from the other end of the room");
  await hold(page, "ArrowRight", "one does not turn", () => window.belvedere.state().yaw < -0.5);
  await page.locator("#intro").waitFor({ timeout });
  // A slow browser turns, and walks, in long steps.
  await page.evaluate(() => window.belvedere.teleport([1, 1.65, 3], -Math.PI / 2, 0));
  await hold(page, "ArrowUp", "no door comes into reach", () => !document.querySelector("#door").hidden);
  await gone(page.locator("#intro"), "who walks is still told how to");
  await page.evaluate((near) => window.belvedere.teleport(near, -Math.PI / 2, 0), NEAR);
  // A walk that failed may have left it closed.
  await page
    .locator("#door")
    .filter({ hasText: `${isClosed ? "open" : "close"} door “leaf”` })
    .waitFor({ timeout });
  if (isClosed) await page.keyboard.press("Enter");
  await closed(page, 0);
  await page.locator("#door").filter({ hasText: "close door “leaf”" }).waitFor({ timeout });
  await hear(page, /Enter: close door “leaf”/);
  // The key is told as a shortcut, and is not part of the name.
  await page.getByRole("button", { name: "close door “leaf”", exact: true }).waitFor({ timeout });
  await page.keyboard.press("Enter");
  await closed(page, 1);
  await hear(page, /door “leaf” is closed now/);
  await page.locator("#door").filter({ hasText: "open door “leaf”" }).waitFor({ timeout });
  await frames(page);
  await page.screenshot({ path: picture("keys-door") });
  const { width, height } = page.viewportSize();
  // Without motion, too, its leaf is in the doorway, where it can be hit.
  await click(page, width / 2, height / 2);
  await closed(page, 0);
  await page.locator("#door").click();
  await closed(page, 1);
  await page.evaluate(() => {
    window.pad.buttons = [{ pressed: true }];
  });
  await closed(page, 0);
  await frames(page, MANY_FRAMES);
  insist((await state(page)).closedDoors.length === 0, "a button that is held is pressed again and again");
  await page.evaluate(() => {
    window.pad.buttons = [];
  });
  await hold(page, "KeyW", "one does not get through", () => window.belvedere.state().position[0] > 8);
  await gone(page.locator("#door"), "a door behind one's back is offered");
}

async function look(page) {
  await hold(page, "PageUp", "one does not look up", () => window.belvedere.state().pitch > 0.3);
  await hold(page, "KeyV", "one does not look down", () => window.belvedere.state().pitch < -0.3);
  await page.keyboard.press("KeyC");
  await until(page, "one does not look straight ahead", () => window.belvedere.state().pitch === 0);
  await page.keyboard.press("KeyF");
  await page.locator("#mode").getByText("Flying: walls do not stop you").waitFor({ timeout });
  await hear(page, /Flying: walls do not stop you/);
  insist((await page.locator("#fly-toggle").getAttribute("aria-pressed")) === "true", "the fly button shows nothing");
  await page.keyboard.press("KeyG");
  await page.locator("#mode").getByText("Frozen: what is shown stays").waitFor({ timeout });
  insist(await page.locator("#fly-toggle").isDisabled(), "one can walk about in a frozen picture");
  await page.locator("#view").focus();
  await page.keyboard.press("KeyG");
  await page.keyboard.press("Escape");
  await gone(page.locator("#inspector"), "Escape does not close the inspector");
  await page.keyboard.press("KeyF");
}

const focused = (page, id, what) => until(page, what, (expected) => document.activeElement?.id === expected, id);

async function panels(page) {
  const panel = page.getByRole("region", { name: "How to move" });
  await page.locator("#map-toggle").focus();
  await page.keyboard.press("?");
  await panel.waitFor({ timeout });
  await focused(page, "help", "the help has not got the focus");
  await page.keyboard.press("Escape");
  await gone(panel, "Escape does not close the help");
  await focused(page, "map-toggle", "after the help the focus is elsewhere");
  await page.keyboard.press("Enter");
  const map = page.locator("#map");
  await map.waitFor({ timeout });
  await page.locator("#map canvas").focus();
  await page.keyboard.press("Escape");
  await gone(map, "Escape does not close the map");
  await focused(page, "map-toggle", "after the map the focus is elsewhere");
  for (const [key, name, inside] of [
    ["KeyM", "map", "#map canvas"],
    ["KeyI", "inspector", "#inspector .close"],
  ]) {
    await page.locator("#view").focus();
    await page.keyboard.press(key);
    await hear(page, new RegExp(`The ${name} is open`));
    await page.locator(inside).focus();
    await page.keyboard.press("Escape");
    await gone(page.locator(inside), `Escape does not close the ${name}`);
    await focused(page, "view", `after the ${name} the focus is lost`);
  }
  await page.locator("#map-toggle").click();
  await map.waitFor({ timeout });
  await focused(page, "view", "who clicks a button cannot go on by keys");
  await page.locator("#map-toggle").click();
}

/** A message is heard, and who answers it by keys is in the world when it has gone. */
async function message(page) {
  await page.evaluate(() => {
    location.hash = "#p=5000,1.65,5000&yaw=0&pitch=0";
  });
  const message = page.getByRole("region", { name: "Message" });
  await hear(page, /This link leads out of the world/);
  await message.getByRole("button", { name: "Go to the start" }).focus();
  await page.keyboard.press("Enter");
  await message.waitFor({ state: "hidden", timeout });
  await focused(page, "view", "after a message the focus is lost");
}

/** What a screen reader finds at the canvas, and in which order Tab goes through the page. */
async function described(page) {
  const canvas = page.getByRole("main").getByRole("application", { name: "doored" });
  await canvas.waitFor({ timeout });
  await page
    .locator("#picture")
    .filter({ hasText: /^Facing (north|south|east|west).*Ahead: / })
    .waitFor({
      state: "attached",
      timeout,
    });
  await canvas.focus();
  const order = [];
  for (let i = 0; i < 8; i += 1) {
    order.push(await page.evaluate(() => document.activeElement?.id));
    const ring = await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle);
    insist(i === 0 || ring !== "none", `the focus cannot be seen at ${order.at(-1)}`);
    await page.keyboard.press("Tab");
  }
  const expected = "view hud-fold choices-fold scenes fly-toggle map-toggle inspector-toggle help-toggle";
  insist(order.join(" ") === expected, `Tab goes to ${order.join(" ")}`);
  await canvas.focus();
  await page.keyboard.press("Shift");
  const ring = await canvas.evaluate((it) => getComputedStyle(it).outlineStyle);
  insist(ring !== "none", "the focus cannot be seen at the canvas");
  await page.screenshot({ path: picture("keys-focus") });
}

/** In a page with an element: one stands before the door. */
function goNear(position) {
  document.querySelector("belvedere-scene").pose = { position, yaw: -Math.PI / 2, pitch: 0, mode: "walk" };
}

/** Enter on a button of the element is for that button, also where a door is in reach, and the focus stays in the element when it goes. */
async function pressInElement(page, door) {
  const link = await page.evaluate(() => document.querySelector("belvedere-scene").src);
  await page.evaluate((nowhere) => {
    document.querySelector("belvedere-scene").src = nowhere;
  }, `${link}#p=3.5,5000,3&yaw=-90&pitch=0`);
  const way = page.locator("belvedere-scene button").getByText("Go to the start");
  await way.waitFor({ timeout });
  await page.evaluate(goNear, NEAR);
  await door.getByText("open").waitFor({ timeout });
  await way.focus();
  await page.keyboard.press("Enter");
  await way.waitFor({ state: "hidden", timeout });
  const isInTheWorld = () => document.querySelector("belvedere-scene").shadowRoot.activeElement?.localName === "canvas";
  await until(page, "the focus is lost when its button is gone", isInTheWorld);
  await page.evaluate(goNear, NEAR);
  await door.getByText("open").waitFor({ timeout });
}

/** A key that is held is let go when the focus leaves from a button of the element. */
async function leaveElement(page, door) {
  const yaw = () => document.querySelector("belvedere-scene").pose.yaw;
  await page.evaluate(() => document.body.append(document.createElement("input")));
  await door.focus();
  const before = await page.evaluate(yaw);
  await page.keyboard.down("ArrowLeft");
  const turns = (from) => document.querySelector("belvedere-scene").pose.yaw !== from;
  await until(page, "a key does not turn who is at the button of a door", turns, before);
  await page.locator("input").focus();
  await atRest(page, "who holds a key while the focus leaves", yaw);
  await page.keyboard.up("ArrowLeft");
}

/** In an element on another page, too, a button says which door is in reach, and who listens hears of it. */
async function inElement(open) {
  const page = await open();
  await page.goto(new URL("embed/example.html", url).href);
  await page.evaluate(() => {
    document.querySelector("belvedere-scene").src = "../?scene=doored";
  });
  await page.evaluate(goNear, NEAR);
  const door = page.locator("belvedere-scene button[aria-keyshortcuts=Enter]");
  await door.getByText("close").waitFor({ timeout });
  const said = page.locator("belvedere-scene [role=status]");
  // By its own clock, so that whatever it would say comes first; nothing tells that it stays silent.
  await page.evaluate((ms) => new Promise((over) => setTimeout(over, ms)), SPOKEN_AFTER_MS);
  insist(!/Enter/.test(await said.textContent()), "a page speaks of a door though nobody is in the world");
  await page.locator("belvedere-scene canvas").focus();
  await said.getByText("Enter: close").waitFor({ state: "attached", timeout });
  await page.keyboard.press("Enter");
  await door.getByText("open").waitFor({ timeout });
  await pressInElement(page, door);
  await leaveElement(page, door);
}

await tell("keys", async (open) => {
  const page = await open({ viewport: { width: 1280, height: 720 }, reducedMotion: "reduce" });
  await page.addInitScript(listen);
  await page.addInitScript(() => {
    window.pad = { id: "some pad", mapping: "standard", axes: [0, 0, 0, 0], buttons: [] };
    navigator.getGamepads = () => [window.pad];
  });
  await throughTheDoor(page);
  await look(page);
  await panels(page);
  await described(page);
  await message(page);
  const { problems } = await state(page);
  insist(problems.length === 0, `the viewer reports: ${problems.join("; ")}`);
  await inElement(open);
  console.log("keys alone lead through a door, and a screen reader is told of it");
});
