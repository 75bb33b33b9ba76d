/**
 * Do panels leave room for each other? Opens them on phones, held upright and aslant, and on a desk, and insists that none covers
 * another, nor the stick, nor leaves the page, that each can be closed or folded, and that every control has a name and can be hit.
 * Environment: see `browser.mjs`.
 */
import {
  addressOf,
  atRest,
  frames,
  gone,
  insist,
  picture,
  settle,
  standing,
  tell,
  timeout,
  until,
  url,
} from "./browser.mjs";

const phone = (width, height) => ({
  viewport: { width, height },
  hasTouch: true,
  isMobile: true,
});
const SIZES = {
  "360x640": phone(360, 640),
  "390x844": phone(390, 844),
  "640x360": phone(640, 360),
  "800x600": { viewport: { width: 800, height: 600 } },
  "1280x800": { viewport: { width: 1280, height: 800 } },
};
const PANELS = [
  "hud",
  "choices",
  "door",
  "recording",
  "intro",
  "mode",
  "dark",
  "toast",
  "map",
  "help",
  "tools",
  "inspector",
  "stick",
];
const FOLDS = ["What is loaded", "Where to go"];
/** Which of what is looked at is worth a picture of its own; where anything is wrong there is one anyway. */
const PICTURED = /-(start|map|inspector|crowded|door)$/;
/** What is smaller than this cannot be read or used. */
const LEAST_PX = 90;
/** Fingers miss what is smaller. */
const TARGET_PX = { touch: 44, mouse: 24 };

/** In the page: where panels are. */
function boxes(ids) {
  const found = ids.map((id) => [id, document.getElementById(id)?.getBoundingClientRect()]);
  return found
    .filter(([, box]) => box && box.width > 0)
    .map(([id, { left, top, right, bottom }]) => ({ id, left, top, right, bottom }));
}

/** In the page: whether all of these are shown, and nothing grows or fades any more. */
function isLaidOut(ids) {
  const areShown = ids.every((id) => document.getElementById(id).getBoundingClientRect().width > 0);
  return areShown && document.getAnimations().length === 0;
}

/** Insists that all of these are shown, and nothing that is shown covers anything else. */
async function roomFor(page, name, ...wanted) {
  await until(page, `${name}: not all of ${wanted} are shown`, isLaidOut, wanted);
  const shown = await atRest(page, name, boxes, PANELS);
  if (PICTURED.test(name)) await page.screenshot({ path: picture(`layout-${name}`) });
  const { width, height } = page.viewportSize();
  for (const id of wanted) {
    const box = shown.find((one) => one.id === id);
    insist(box, `${name}: ${id} does not stay`);
    const tall = box.bottom - box.top >= LEAST_PX || !["map", "help", "inspector"].includes(id);
    insist(tall, `${name}: ${id} is only ${box.bottom - box.top} px high`);
  }
  for (const [i, a] of shown.entries()) {
    const out = a.left < -0.5 || a.top < -0.5 || a.right > width + 0.5 || a.bottom > height + 0.5;
    insist(!out, `${name}: ${a.id} leaves the page: ${JSON.stringify(a)}`);
    for (const b of shown.slice(i + 1)) {
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const along = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      insist(across <= 0.5 || along <= 0.5, `${name}: ${a.id} and ${b.id} overlap: ${JSON.stringify([a, b])}`);
    }
  }
}

/** Touches the page where it would walk, with the stick drawn. */
async function touching(page, x, y, then) {
  const touches = await page.context().newCDPSession(page);
  await touches.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [{ x, y }] });
  await then();
  await touches.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
}

const button = (page, name) => page.getByRole("button", { name, exact: true });

/** Every control in the tree that screen readers get. */
async function nameControls(page, where) {
  const session = await page.context().newCDPSession(page);
  const { nodes } = await session.send("Accessibility.getFullAXTree");
  const controls = /^(button|checkbox|combobox|application|link|progressbar|DisclosureTriangle|textbox|slider)$/;
  const met = nodes.filter(({ ignored, role }) => !ignored && controls.test(role?.value));
  insist(met.length >= 6, `${where}: only ${met.length} controls are told to screen readers`);
  for (const { role, name } of met) insist(name?.value?.trim(), `${where}: a ${role.value} has no name`);
}

async function hitControls(page, where, touch) {
  const least = touch ? TARGET_PX.touch : TARGET_PX.mouse;
  const small = await page.evaluate((px) => {
    const controls = [...document.querySelectorAll(":is(button, select, summary, a, .toggle)")];
    const sized = controls.map((one) => [one.id || one.title || one.textContent, one.getBoundingClientRect()]);
    return sized.filter(([, box]) => box.width > 0 && Math.min(box.width, box.height) < px).map(([name]) => name);
  }, least);
  insist(small.length === 0, `${where}: smaller than ${least} px are ${small.join(", ")}`);
}

async function panels(page, name, touch) {
  await page.goto(url);
  await settle(page, "the first cell");
  await roomFor(page, `${name}-start`, "hud", "intro", "tools");
  for (const fold of FOLDS) {
    if ((await button(page, fold).getAttribute("aria-expanded")) === "false") await button(page, fold).click();
  }
  await roomFor(page, `${name}-unfolded`, "hud", "choices", "tools");
  await hitControls(page, name, touch);
  await button(page, "Map").click();
  await roomFor(page, `${name}-map`, "map", "tools");
  await button(page, "How to move").click();
  await roomFor(page, `${name}-help`, "help", "tools");
  await nameControls(page, `${name} with its help`);
  await closeFromItsEnd(name, page.locator("#help"), button(page, "Close the help"));
  for (const fold of FOLDS) {
    if ((await button(page, fold).getAttribute("aria-expanded")) === "false") await button(page, fold).click();
    await button(page, fold).click();
  }
  await gone(page.locator("#figures"), `${name}: what is loaded does not fold`);
  await gone(page.locator("#places"), `${name}: where to go does not fold`);
  if (await page.locator("#map").isVisible()) await button(page, "Map").click();
  await button(page, "Fly").click();
  insist((await button(page, "Fly").getAttribute("aria-pressed")) === "true", `${name}: the fly button shows nothing`);
  insist((await page.evaluate(() => window.belvedere.state().mode)) === "fly", `${name}: its button does not fly`);
  await roomFor(page, `${name}-fly`, "mode", "tools", "choices", "hud");
  const speaksOfKeys = /\bF\b/.test(await page.locator("#mode").innerText());
  insist(speaksOfKeys !== Boolean(touch), `${name}: who ${touch ? "has fingers" : "has keys"} is told of the other`);
  await button(page, "Fly").click();
  if (touch) {
    for (const [x, y] of [
      [8, 90],
      [60, page.viewportSize().height - 20],
    ]) {
      await touching(page, x, y, () => roomFor(page, `${name}-stick-${x}`, "stick"));
    }
  }
  await button(page, "Inspector").click();
  await roomFor(page, `${name}-inspector`, "inspector", "hud", "tools");
  await nameControls(page, `${name} with the inspector`);
  await hitControls(page, `${name} with the inspector`, touch);
  // On a small screen it makes room for what is opened from beside it.
  await button(page, "Map").click();
  await roomFor(page, `${name}-inspector-map`, "map", "tools");
  await button(page, "Map").click();
  if (await page.locator("#inspector").isHidden()) await button(page, "Inspector").click();
  await closeFromItsEnd(name, page.locator("#inspector"), button(page, "Close the inspector"));
  await page.reload();
  await settle(page, "the same again");
  insist(await page.locator("#figures").isHidden(), `${name}: it is forgotten what was folded`);
}

/** With a door in reach, a recording under way, a message, and one's first hint while one flies: beside each panel. */
async function crowded(page, name, touch) {
  await page.keyboard.press("KeyF");
  await page.evaluate(() => window.belvedere.recording.start());
  const { width, height } = page.viewportSize();
  const isSmall = width <= 640 || height <= 480;
  const notes = ["door", "recording", "toast", ...(isSmall ? [] : ["intro", "mode"])];
  await page.locator("#recording").waitFor({ timeout });
  await roomFor(page, `${name}-crowded`, ...notes, "tools", "hud", "choices");
  for (const fold of FOLDS) {
    if ((await button(page, fold).getAttribute("aria-expanded")) === "false") await button(page, fold).click();
    await roomFor(page, `${name}-crowded-${fold}`, ...notes, "tools", "hud", "choices");
  }
  for (const [key, id] of [
    ["KeyM", "map"],
    ["KeyI", "inspector"],
  ]) {
    await page.keyboard.press(key);
    await roomFor(page, `${name}-crowded-${id}`, ...notes, id, "hud");
    await hitControls(page, `${name} with all notes and the ${id}`, touch);
    await page.keyboard.press(key);
  }
  await page.evaluate(() => window.belvedere.recording.stop());
  await page.keyboard.press("KeyF");
  // The help takes the first hint away.
  await page.keyboard.press("KeyH");
  await roomFor(page, `${name}-crowded-help`, "door", "toast", "help");
  await page.keyboard.press("KeyH");
}

async function atDoor(page, name, touch) {
  await page.goto(`${addressOf("doored")}#p=4,1.65,3&yaw=-90&pitch=0&rev=0123456789abcdef`);
  await settle(page, "the rooms");
  await page.locator("#door").waitFor({ timeout });
  await roomFor(page, `${name}-door`, "door", "toast", "tools");
  await hitControls(page, `${name} at a door`, touch);
  await crowded(page, name, touch);
  await page.evaluate(() => window.belvedere.recording.start());
  await page.locator("#recording").waitFor({ timeout });
  await roomFor(page, `${name}-door-recording`, "door", "recording", "tools");
  await hitControls(page, `${name} while recording`, touch);
  await page.evaluate(() => window.belvedere.recording.stop());
  await page.locator("#map-toggle").click();
  await roomFor(page, `${name}-door-map`, "door", "map");
  await page.locator("#map-toggle").click();
  if (touch)
    await touching(page, 20, page.viewportSize().height / 2, () => roomFor(page, `${name}-door-stick`, "stick"));
}

/** What keeps the page from opening can be read to its end, and each way out be hit. */
async function problem(page, name, touch) {
  await page.goto(addressOf("nowhere"));
  await page.getByRole("alertdialog", { name: "There is no scene called" }).waitFor({ timeout });
  await frames(page);
  await page.screenshot({ path: picture(`layout-${name}-problem`) });
  await hitControls(page, `${name} with a problem`, touch);
  const { height } = page.viewportSize();
  for (const id of ["problem-retry", "problem-title"]) {
    await page.locator(`#${id}`).scrollIntoViewIfNeeded();
    const box = await page.locator(`#${id}`).boundingBox();
    insist(box.y >= 0 && box.y + box.height <= height, `${name}: one cannot scroll to ${id}: ${JSON.stringify(box)}`);
  }
}

/** Wherever one has scrolled to in a panel, it can be closed. */
async function closeFromItsEnd(name, panel, close) {
  await panel.evaluate((it) => it.scrollTo(0, it.scrollHeight));
  const [outer, inner] = [await panel.boundingBox(), await close.boundingBox()];
  insist(inner.y >= outer.y, `${name}: the way out of a panel is scrolled away`);
  await close.click();
  await gone(panel, `${name}: a panel does not close from its end`);
}

/** A message that is longer than its place is read to its end by keys, which do not walk meanwhile. */
async function longMessage(page) {
  await page.goto(url);
  await settle(page, "the first cell");
  const from = (await standing(page)).position;
  await page.evaluate((text) => {
    document.querySelector("#toast").hidden = false;
    document.querySelector("#toast-text").textContent = text;
  }, "There is much to say. ".repeat(40));
  const text = page.locator("#toast-text[tabindex='0']");
  await text.waitFor({ timeout });
  await page.locator("#toast-retry").focus();
  await page.keyboard.press("Shift+Tab");
  await until(page, "a long message is not reached by keys", () => document.activeElement.id === "toast-text");
  await page.keyboard.press("End");
  await page.keyboard.press("ArrowDown");
  const isRead = (it) => it.scrollTop > 0 && it.scrollTop + it.clientHeight >= it.scrollHeight - 1;
  await page.waitForFunction(isRead, await text.elementHandle(), { timeout });
  await page.screenshot({ path: picture("layout-long-message") });
  const { position } = await standing(page);
  insist(String(position) === String(from), "keys that scroll a message walk, too");
}

/** Where the system chooses the colours, one's own place stands on the map in the ink of its text. */
async function inForcedColours(page) {
  await page.goto(url);
  await settle(page, "the first cell");
  await button(page, "Map").click();
  await roomFor(page, "forced-colours-map", "map", "tools");
  const inked = await page.evaluate(() => {
    const probe = document.createElement("i");
    probe.style.cssText = "color: CanvasText; forced-color-adjust: none";
    document.body.append(probe);
    const [red, green, blue] = getComputedStyle(probe)
      .color.match(/[\d.]+/g)
      .map(Number);
    const map = document.querySelector("#map canvas");
    const { data } = map.getContext("2d").getImageData(0, 0, map.width, map.height);
    let pixels = 0;
    for (let i = 0; i < data.length; i += 4) {
      if (data[i] === red && data[i + 1] === green && data[i + 2] === blue && data[i + 3] === 255) pixels += 1;
    }
    return pixels;
  });
  insist(inked >= 100, `in forced colours only ${inked} pixels of the map have the colour of text`);
}

await tell("layout", async (open) => {
  for (const [name, options] of Object.entries(SIZES)) {
    const page = await open(options);
    await panels(page, name, options.hasTouch);
    await atDoor(page, name, options.hasTouch);
    await page.close();
    const lost = await open(options, /status of 404/);
    await problem(lost, name, options.hasTouch);
    await lost.close();
  }
  const long = await open({ viewport: { width: 520, height: 360 } });
  await longMessage(long);
  await long.close();
  const forced = await open({ viewport: { width: 1280, height: 800 }, forcedColors: "active" });
  await inForcedColours(forced);
  await forced.close();
  console.log(`panels leave room for each other at ${Object.keys(SIZES).join(", ")}`);
});
