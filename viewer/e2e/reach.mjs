/**
 * Who can use the page? Somebody with a keyboard alone, with a phone, with a gamepad, with a link from a friend, from viewpoint to viewpoint, and somebody
 * whose browser cannot draw, who gets a sentence. Environment: see `browser.mjs`.
 */
import {
  addressed,
  drawn,
  frames,
  gone,
  insist,
  picture,
  settle,
  standing,
  state,
  tell,
  timeout,
  until,
  url,
} from "./browser.mjs";

const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 };

const distance = (a, b) => Math.hypot(a[0] - b[0], a[2] - b[2]);

async function byKeyboard(page) {
  await page.goto(url);
  const start = await settle(page, "the first cell");
  const names = new Set();
  for (let i = 0; i < 12; i += 1) {
    await page.keyboard.press("Tab");
    names.add(await page.evaluate(() => document.activeElement?.getAttribute("aria-label") ?? ""));
  }
  for (const name of ["Map", "Inspector", "How to move"]) insist(names.has(name), `Tab does not reach "${name}"`);
  await page.locator("#view").focus();
  await page.keyboard.press("KeyM");
  await page.locator("#map canvas").focus();
  await drawn(page);
  await page.screenshot({ path: picture("map") });
  for (let i = 0; i < 3; i += 1) await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  await until(
    page,
    "Enter on the map leads nowhere",
    (p) => window.belvedere.state().position[0] > p + 1,
    start.position[0],
  );
  const { position } = await addressed(page);
  const link = page.url();
  insist(link.includes(`rev=${start.revision}`), `the address ${link} does not carry the revision`);
  return { link, there: position };
}

async function byLink(page, { link, there }) {
  // The address of the page itself would not be opened anew.
  await page.goto("about:blank");
  await page.goto(link);
  const { position } = await settle(page, "the place of the link");
  insist(distance(position, there) < 0.02, `a link to ${there} leads to ${position}`);
  const said = await page.locator("#toast-text").textContent();
  insist(!said.includes("has changed"), "a link of this revision is said to be of another");
  await page.goto("about:blank");
  await page.goto(link.replace(/rev=\w+/, "rev=0123456789abcdef"));
  await settle(page, "the place of an old link");
  await page.locator("#toast-text").getByText("has changed since the link was made").waitFor({ timeout });
}

/** Who flies is where a link was copied, and flying, also after a reload; F comes down onto the floor below. */
async function byFlownLink(page) {
  await page.goto(url);
  const start = await settle(page, "the first cell");
  await page.keyboard.press("KeyF");
  await page.keyboard.down("KeyE");
  await until(page, "one does not rise", (y) => window.belvedere.state().position[1] > y + 2, start.position[1]);
  await page.keyboard.up("KeyE");
  const flown = await addressed(page);
  await page.reload();
  const again = await settle(page, "the place of a link in the air");
  const isThere = again.position.every((x, i) => Math.abs(x - flown.position[i]) < 0.02);
  insist(
    again.mode === "fly" && isThere,
    `a reload leads from ${flown.position} to ${again.mode} at ${again.position}`,
  );
  await page.keyboard.press("KeyF");
  await until(page, "one does not come down", () => {
    const { mode, inside } = window.belvedere.state();
    return mode === "walk" && inside;
  });
  await settle(page, "the ground below");
  const down = await standing(page);
  const height = down.position[1] - start.position[1];
  insist(Math.abs(height) < 0.3, `one comes down ${height} m above where one was`);
  insist(distance(down.position, start.position) < 1, `one comes down aside, at ${down.position}`);
}

/** A link that leads nowhere says so, and there is a way back. */
async function byStrayLink(page) {
  await page.goto("about:blank");
  await page.goto(`${url}#p=5000,1.65,5000&yaw=0&pitch=0`);
  await page.locator("#toast-text").getByText("This link leads out of the world").waitFor({ timeout });
  await page.screenshot({ path: picture("stray") });
  const way = page.getByRole("button", { name: "Go to the start" });
  await way.click();
  const start = await settle(page, "the start");
  insist(Math.abs(start.position[0]) < 4000, `the way back leads to ${start.position}`);
  await gone(way, "who is back is still offered the way back");
  await page.goto("about:blank");
  await page.goto(`${url}#p=1,NaN,2`);
  await page.locator("#toast-text").getByText("The place in this link cannot be read").waitFor({ timeout });
  await settle(page, "the start in place of what cannot be read");
}

/** Nothing of the old place is told as of the new one, from the first moment. */
async function byViewpoint(page) {
  await page.goto(url);
  await settle(page, "the first cell");
  const jumped = await page.evaluate(() => {
    const viewpoints = document.querySelector("#viewpoints");
    viewpoints.value = String(viewpoints.options.length - 2);
    viewpoints.dispatchEvent(new Event("change"));
    return window.belvedere.state();
  });
  const { missing, settled } = jumped;
  insist(missing === null && !settled, `at once after a jump ${missing} objects are missing, settled: ${settled}`);
  const there = await settle(page, "the last viewpoint");
  insist(distance(there.position, jumped.position) < 0.02, "a viewpoint is not where one gets");
}

async function byPhone(page) {
  await page.goto(url);
  const start = await settle(page, "the first cell on a phone");
  await page.screenshot({ path: picture("phone") });
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  insist(wide <= 0, `the page is ${wide} px wider than a phone`);
  const touches = await page.context().newCDPSession(page);
  const touch = (type, x, y) =>
    touches.send("Input.dispatchTouchEvent", { type, touchPoints: type === "touchEnd" ? [] : [{ x, y }] });
  await touch("touchStart", 90, 600);
  await touch("touchMove", 90, 540);
  await until(
    page,
    "dragging on the left does not walk",
    ([x, , z]) => {
      const { position } = window.belvedere.state();
      return Math.hypot(position[0] - x, position[2] - z) > 0.3;
    },
    start.position,
  );
  await touch("touchEnd");
  const { yaw } = await state(page);
  await touch("touchStart", 300, 500);
  await touch("touchMove", 240, 500);
  await touch("touchEnd");
  await until(
    page,
    "dragging on the right does not look around",
    (before) => window.belvedere.state().yaw !== before,
    yaw,
  );
  await page.getByRole("button", { name: "Map", exact: true }).tap();
  await page.locator("#map canvas[aria-label]").waitFor({ timeout });
  await drawn(page);
  await page.screenshot({ path: picture("phone-map") });
  await page.getByRole("button", { name: "Inspector", exact: true }).tap();
  await page.locator("#inspector").waitFor({ timeout });
  await frames(page);
  await page.screenshot({ path: picture("phone-inspector") });
}

async function byGamepad(page) {
  await page.addInitScript(() => {
    window.pad = { id: "some pad", mapping: "standard", axes: [0, 0, 0, 0], buttons: [] };
    navigator.getGamepads = () => [null, window.pad];
  });
  await page.goto(url);
  const start = await settle(page, "the first cell");
  await page.evaluate(() => {
    window.pad = { id: "some pad", mapping: "standard", axes: [0, -1, 0.6, 0], buttons: [] };
  });
  await until(
    page,
    "the sticks do nothing",
    ([p, yaw]) => {
      const now = window.belvedere.state();
      return Math.hypot(now.position[0] - p[0], now.position[2] - p[2]) > 0.3 && now.yaw !== yaw;
    },
    [start.position, start.yaw],
  );
}

/** Presses a button of the gamepad between two frames of a machine that draws slowly, and lets it go before the next. */
function tapPad(page, button) {
  const pressed = Array.from({ length: button + 1 }, (_, i) => ({ pressed: i === button }));
  return page.evaluate(
    (buttons) =>
      new Promise((done) => {
        requestAnimationFrame(() => {
          window.pad = { ...window.pad, buttons };
          setTimeout(() => {
            window.pad = { ...window.pad, buttons: [] };
            done();
          }, 100);
        });
      }),
    pressed,
  );
}

async function byGamepadSlowly(page) {
  await page.addInitScript(() => {
    window.pad = { id: "some pad", mapping: "standard", axes: [0, 0, 0, 0], buttons: [] };
    navigator.getGamepads = () => [window.pad];
    const next = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (frame) => (window.isSlow ? setTimeout(() => next(frame), 500) : next(frame));
  });
  await page.goto(url);
  const { position } = await settle(page, "the first cell");
  await page.evaluate(() => {
    window.isSlow = true;
  });
  const [upper, rightShoulder] = [3, 5];
  await tapPad(page, upper);
  await until(page, "a short press does not fly", () => window.belvedere.state().mode === "fly");
  await tapPad(page, rightShoulder);
  await until(page, "a short press does not rise", (y) => window.belvedere.state().position[1] > y + 0.05, position[1]);
}

async function withoutWebGl(page) {
  await page.addInitScript(() => {
    const before = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
      return kind.startsWith("webgl") ? null : before.call(this, kind, ...more);
    };
  });
  await page.goto(url);
  await page.getByRole("alertdialog", { name: "3-D graphics are not available" }).waitFor({ timeout });
  await page.screenshot({ path: picture("no-webgl") });
  const sentence = await page.locator("#problem-text").textContent();
  const told = await page.evaluate(async () => {
    const scene = document.createElement("belvedere-scene");
    scene.src = location.href;
    const problem = new Promise((tell) => scene.addEventListener("problem", ({ detail }) => tell(detail.message)));
    await import(new URL("embed/belvedere-scene.js", location.href).href);
    document.body.append(scene);
    return problem;
  });
  insist(told === sentence, `whoever embeds the world is told “${told}”, and the page says “${sentence}”`);
}

await tell("reach", async (open) => {
  const page = await open();
  await byLink(page, await byKeyboard(page));
  await byViewpoint(page);
  await byFlownLink(page);
  await byStrayLink(page);
  await page.close();
  // One after the other: a page that stays open goes on drawing.
  for (const [way, options] of [[byPhone, PHONE], [byGamepad], [byGamepadSlowly], [withoutWebGl]]) {
    const another = await open(options);
    await way(another);
    await another.close();
  }
  console.log("a keyboard, a link, a phone and a gamepad suffice; without WebGL there is a sentence");
});
