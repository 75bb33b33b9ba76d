/**
 * Can one walk without a mouse? Walks up to a door with keys alone, closes and opens it with Enter, with a gamepad and with its
 * button, looks up and down, flies, asks for help, and listens to what a screen reader is told. `BELVEDERE_URL` names a tree that
 * has the scene `doored` (`e2e/worlds`). Environment: see `browser.mjs`.
 */
import { addressOf, insist, picture, settle, state, tell, timeout, url } from "./browser.mjs";

async function until(page, what, test, argument) {
  try {
    await page.waitForFunction(test, argument, { timeout, polling: 50 });
  } catch {
    throw new Error(`${what}: ${JSON.stringify(await state(page))}`);
  }
}

const closed = (page, count) =>
  until(page, `${count} closed doors are expected`, (n) => window.belvedere.state().closedDoors.length === n, count);

async function hear(page, pattern) {
  await page.locator("#live").filter({ hasText: pattern }).waitFor({ state: "attached", timeout });
}

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
  await page.goto(`${addressOf("doored")}#p=1,1.65,3&yaw=0&pitch=0`);
  await settle(page, "the rooms");
  await page.waitForTimeout(1000);
  insist(await page.locator("#door").isHidden(), "a door is offered from the other end of the room");
  await hold(page, "ArrowRight", "one does not turn", () => Math.abs(window.belvedere.state().yaw + 1.57) < 0.15);
  await page.locator("#intro").waitFor({ timeout });
  // A slow browser turns in long steps.
  await page.evaluate(() => window.belvedere.teleport([1, 1.65, 3], -Math.PI / 2, 0));
  await hold(page, "ArrowUp", "no door comes into reach", () => !document.querySelector("#door").hidden);
  insist(await page.locator("#intro").isHidden(), "who walks is still told how to");
  // Doors outlive servers: a walk that failed may have left it closed.
  if ((await state(page)).closedDoors.length > 0) await page.keyboard.press("Enter");
  await closed(page, 0);
  await page.locator("#door").filter({ hasText: "close door “leaf”" }).waitFor({ timeout });
  await hear(page, /Enter: close door “leaf”/);
  // The key is told as a shortcut, and is not part of the name.
  await page.getByRole("button", { name: "close door “leaf”", exact: true }).waitFor({ timeout });
  await page.keyboard.press("Enter");
  await closed(page, 1);
  await hear(page, /door “leaf” is closed now/);
  await page.locator("#door").filter({ hasText: "open door “leaf”" }).waitFor({ timeout });
  await page.waitForTimeout(1000);
  await page.screenshot({ path: picture("keys-door") });
  const { width, height } = page.viewportSize();
  // Without motion, too, its leaf is in the doorway, where it can be hit.
  await page.mouse.click(width / 2, height / 2);
  await closed(page, 0);
  await page.locator("#door").click();
  await closed(page, 1);
  await page.evaluate(() => {
    window.pad.buttons = [{ pressed: true }];
  });
  await closed(page, 0);
  await page.waitForTimeout(500);
  insist((await state(page)).closedDoors.length === 0, "a button that is held is pressed again and again");
  await page.evaluate(() => {
    window.pad.buttons = [];
  });
  await hold(page, "KeyW", "one does not get through", () => window.belvedere.state().position[0] > 8);
  insist(await page.locator("#door").isHidden(), "a door behind one's back is offered");
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
  insist(await page.locator("#inspector").isHidden(), "Escape does not close the inspector");
  await page.keyboard.press("KeyF");
}

const inTheWorld = (page) => page.evaluate(() => document.activeElement?.id === "view");

async function panels(page) {
  const panel = page.getByRole("region", { name: "How to move" });
  await page.locator("#map-toggle").focus();
  await page.keyboard.press("?");
  await panel.waitFor({ timeout });
  insist(await panel.evaluate((it) => it === document.activeElement), "the help has not got the focus");
  await page.keyboard.press("Escape");
  insist(await panel.isHidden(), "Escape does not close the help");
  const back = await page.evaluate(() => document.activeElement?.id);
  insist(back === "map-toggle", `after the help the focus is at ${back}`);
  await page.keyboard.press("Enter");
  const map = page.locator("#map");
  await map.waitFor({ timeout });
  await page.locator("#map canvas").focus();
  await page.keyboard.press("Escape");
  insist(await map.isHidden(), "Escape does not close the map");
  const origin = await page.evaluate(() => document.activeElement?.id);
  insist(origin === "map-toggle", `after the map the focus is at ${origin}`);
  for (const [key, name, inside] of [
    ["KeyM", "map", "#map canvas"],
    ["KeyI", "inspector", "#inspector .close"],
  ]) {
    await page.locator("#view").focus();
    await page.keyboard.press(key);
    await hear(page, new RegExp(`The ${name} is open`));
    await page.locator(inside).focus();
    await page.keyboard.press("Escape");
    insist(await page.locator(inside).isHidden(), `Escape does not close the ${name}`);
    insist(await inTheWorld(page), `after the ${name} the focus is lost`);
  }
  await page.locator("#map-toggle").click();
  await map.waitFor({ timeout });
  insist(await inTheWorld(page), "who clicks a button cannot go on by keys");
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
  insist(await inTheWorld(page), "after a message the focus is lost");
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

/** Enter on a button of the element is for that button, also where a door is in reach, and the focus stays in the element when it goes. */
async function pressInElement(page, door) {
  const link = await page.evaluate(() => document.querySelector("belvedere-scene").src);
  await page.evaluate((nowhere) => {
    document.querySelector("belvedere-scene").src = nowhere;
  }, `${link}#p=3.5,5000,3&yaw=-90&pitch=0`);
  const way = page.locator("belvedere-scene button").getByText("Go to the start");
  await way.waitFor({ timeout });
  await page.evaluate(() => {
    window.near = { position: [3.5, 1.65, 3], yaw: -Math.PI / 2, pitch: 0, mode: "walk" };
    document.querySelector("belvedere-scene").pose = window.near;
  });
  await door.getByText("open").waitFor({ timeout });
  await way.focus();
  await page.keyboard.press("Enter");
  await way.waitFor({ state: "hidden", timeout });
  const at = await page.evaluate(() => document.querySelector("belvedere-scene").shadowRoot.activeElement?.localName);
  insist(at === "canvas", `the focus is at ${at} when its button is gone`);
  await page.evaluate(() => {
    document.querySelector("belvedere-scene").pose = window.near;
  });
  await door.getByText("open").waitFor({ timeout });
}

/** A key that is held is let go when the focus leaves from a button of the element. */
async function leaveElement(page, door) {
  const yaw = () => page.evaluate(() => document.querySelector("belvedere-scene").pose.yaw);
  await page.evaluate(() => document.body.append(document.createElement("input")));
  await door.focus();
  const before = await yaw();
  await page.keyboard.down("ArrowLeft");
  await page.waitForFunction((from) => document.querySelector("belvedere-scene").pose.yaw !== from, before, {
    timeout,
  });
  await page.locator("input").focus();
  await page.waitForTimeout(500);
  const left = await yaw();
  await page.waitForTimeout(500);
  insist((await yaw()) === left, "a key stays held though the focus has left");
  await page.keyboard.up("ArrowLeft");
}

/** In an element on another page, too, a button says which door is in reach, and who listens hears of it. */
async function inElement(open) {
  const page = await open();
  await page.goto(new URL("embed/example.html", url).href);
  await page.evaluate(() => {
    const element = document.querySelector("belvedere-scene");
    element.src = "../?scene=doored";
    element.pose = { position: [3.5, 1.65, 3], yaw: -Math.PI / 2, pitch: 0, mode: "walk" };
  });
  const door = page.locator("belvedere-scene button[aria-keyshortcuts=Enter]");
  await door.getByText("close").waitFor({ timeout });
  const said = page.locator("belvedere-scene [role=status]");
  await page.waitForTimeout(1500);
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
