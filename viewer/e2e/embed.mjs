/**
 * Does one tag show a world? Opens the example page, walks in it by keys that count only while it has the focus, gives the
 * element another link, takes it out of the page and gives another one a tree that is not there. Environment: see `browser.mjs`.
 */
import { frames, insist, picture, tell, timeout, until, url } from "./browser.mjs";

/** In these a key, or a gamepad, is looked at many times. */
const MANY_FRAMES = 10;

const pose = (page) => page.evaluate(() => document.querySelector("belvedere-scene").pose);

function ready(page, what, change) {
  return page.evaluate(
    ([code, limit, name]) =>
      new Promise((resolve, reject) => {
        const element = document.querySelector("belvedere-scene");
        element.addEventListener("ready", resolve, { once: true });
        element.addEventListener("problem", ({ detail }) => reject(new Error(`${name}: ${detail}`)), { once: true });
        setTimeout(() => reject(new Error(`${name} was not ready in time`)), limit);
        if (code) element.setAttribute("src", code);
      }),
    [change, timeout, what],
  );
}

/** Waits until the element has changed its pose. */
const moves = (page, what, from) =>
  until(
    page,
    what,
    (before) => JSON.stringify(document.querySelector("belvedere-scene").pose) !== before,
    JSON.stringify(from),
  );

/** After a double click the mouse turns the head without being dragged. */
async function byHeldPointer(page) {
  const { x, y, width, height } = await page.locator("belvedere-scene canvas").boundingBox();
  const [middleX, middleY] = [x + width / 2, y + height / 2];
  await page.mouse.dblclick(middleX, middleY);
  await page.waitForFunction(() => document.pointerLockElement !== null, undefined, { timeout });
  const { yaw } = await pose(page);
  for (let step = 1; step <= 10; step += 1) await page.mouse.move(middleX + 10 * step, middleY);
  const hasTurned = (from) => Math.abs(document.querySelector("belvedere-scene").pose.yaw - from) > 0.1;
  await until(page, "a mouse that is held does not look around", hasTurned, yaw);
  await page.evaluate(() => document.exitPointerLock());
}

/** Of two elements that one moves which has the focus, or had it last, and none while one types. */
async function byGamepad(page, src) {
  await page.evaluate(async (link) => {
    window.pad = { id: "some pad", mapping: "standard", axes: [0, 0, 0, 0], buttons: [] };
    navigator.getGamepads = () => [window.pad];
    const worlds = [1, 2].map(() => document.createElement("belvedere-scene"));
    for (const world of worlds) world.src = link;
    const ready = worlds.map((world) => new Promise((done) => world.addEventListener("ready", done, { once: true })));
    document.body.append(...worlds, document.createElement("input"));
    await Promise.all(ready);
  }, src);
  const push = (yaw) =>
    page.evaluate((axis) => {
      window.pad = { ...window.pad, axes: [0, 0, axis, 0] };
    }, yaw);
  // In each of these frames a world turns that listens.
  const moved = async () => {
    const yaws = () =>
      page.evaluate(() => [...document.querySelectorAll("belvedere-scene")].map((one) => one.pose.yaw));
    const before = await yaws();
    await push(0.8);
    await frames(page, MANY_FRAMES);
    await push(0);
    await frames(page);
    return (await yaws()).map((yaw, i) => yaw !== before[i]).join();
  };
  const worlds = page.locator("belvedere-scene canvas");
  await worlds.nth(1).focus();
  insist((await moved()) === "false,true", "the element that has the focus is not the one that a gamepad moves");
  await page.evaluate(() => document.activeElement.blur());
  insist((await moved()) === "false,true", "the element that had the focus last is not the one that a gamepad moves");
  await page.locator("input").focus();
  insist((await moved()) === "false,false", "a gamepad moves a world while somebody types");
  await page.evaluate(() => {
    for (const world of document.querySelectorAll("belvedere-scene, input")) world.remove();
  });
}

/** Who cannot see it is told what is ahead, and is not told of each kilobyte. */
async function heard(page) {
  const picture = page.locator("belvedere-scene canvas");
  insist((await picture.getAttribute("aria-describedby")) === "picture", "nothing describes the picture");
  const words = page.locator("belvedere-scene #picture");
  await words.getByText("Facing").waitFor({ state: "attached", timeout });
  const said = await page.locator("belvedere-scene [role=status]").textContent();
  insist(!/\d of /.test(said), `who listens hears of progress: ${said}`);
  insist((await page.locator("belvedere-scene p").getAttribute("role")) === null, "the progress is read aloud");
}

/** The stick appears below the finger, also where the page has moved or shrunk what the element stands in. */
async function byFinger(open, src) {
  const page = await open({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  await page.goto(new URL("embed/example.html", url).href);
  await page.evaluate((link) => {
    const frame = document.createElement("div");
    frame.style = "transform: translateY(150px) scale(0.8); width: 360px; padding: 10px";
    const element = document.querySelector("belvedere-scene");
    element.style = "border: 7px solid; padding: 5px";
    element.replaceWith(frame);
    frame.append(element);
    element.src = link;
  }, src);
  await page.waitForFunction(() => document.querySelector("belvedere-scene").pose, undefined, { timeout });
  const box = await page.locator("belvedere-scene canvas").boundingBox();
  const [x, y] = [box.x + 70, box.y + 90];
  const touch = await page.context().newCDPSession(page);
  await touch.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [{ x, y }] });
  await touch.send("Input.dispatchTouchEvent", { type: "touchMove", touchPoints: [{ x: x + 3, y: y - 20 }] });
  await page.locator("belvedere-scene .stick").waitFor({ timeout });
  const stick = await page.locator("belvedere-scene .stick").boundingBox();
  const off_px = Math.hypot(stick.x + stick.width / 2 - x, stick.y + stick.height / 2 - y);
  insist(off_px < 2, `the stick is ${off_px} px from the finger`);
  await touch.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
}

await tell("embed", async (open) => {
  const page = await open();
  const base = new URL(url);
  await page.goto(new URL("embed/example.html", base).href, { waitUntil: "commit" });
  await page.waitForFunction(() => customElements.get("belvedere-scene") && document.querySelector("belvedere-scene"));
  await ready(page, "the example", `../${base.search}`);
  await frames(page);
  await page.screenshot({ path: picture("embed") });
  await heard(page);
  const start = await pose(page);
  await page.keyboard.down("KeyW");
  await frames(page, MANY_FRAMES);
  await page.keyboard.up("KeyW");
  insist(String((await pose(page)).position) === String(start.position), "it moves though the page has the focus");
  await page.locator("belvedere-scene canvas").focus();
  await page.keyboard.down("KeyW");
  await moves(page, "it does not move though it has the focus", start);
  await page.keyboard.up("KeyW");
  const [x, y, z] = start.position;
  await ready(page, "another link", `../${base.search}#p=${[x + 1, y, z].join()}&yaw=90&pitch=0`);
  insist(Math.abs((await pose(page)).position[0] - x - 1) < 0.01, "the pose of the link is not taken");
  // Who moves it in the page, or gives it another place, goes on in the same world.
  const before = await pose(page);
  const canvas = await page.locator("belvedere-scene canvas").elementHandle();
  await ready(page, "another place", `../${base.search}#p=${[x + 0.5, y, z].join()}&yaw=0&pitch=0`);
  insist(await canvas.evaluate((one) => one.isConnected), "another place begins all over");
  insist(Math.abs((await pose(page)).position[0] - x - 0.5) < 0.01, "another place in the same world is not taken");
  // A link without a place leads to the start, and what was said of the one before is over.
  const message = page.locator("belvedere-scene p");
  await page.evaluate(
    (nowhere) => {
      document.querySelector("belvedere-scene").src = nowhere;
    },
    `../${base.search}#p=${[x, y + 5000, z].join()}&yaw=0&pitch=0`,
  );
  await page.locator("belvedere-scene button").getByText("Go to the start").waitFor({ timeout });
  await ready(page, "a link without a place", `../${base.search}`);
  insist(await canvas.evaluate((one) => one.isConnected), "a link without a place begins all over");
  insist(
    String((await pose(page)).position) === String(start.position),
    "a link without a place does not lead to the start",
  );
  insist(!/link/.test(await message.textContent()), `after a good link it says: ${await message.textContent()}`);
  await page.evaluate((there) => {
    const element = document.querySelector("belvedere-scene");
    element.pose = there;
    document.body.prepend(element);
  }, before);
  await page.waitForFunction(() => document.querySelector("belvedere-scene").pose, undefined, { timeout });
  insist(Math.abs((await pose(page)).position[0] - x - 1) < 0.01, "who is moved in the page starts all over");
  const refused = await page.evaluate(() => {
    const element = document.querySelector("belvedere-scene");
    try {
      element.pose = { yaw: 1 };
    } catch (error) {
      return String(error);
    }
    return "nothing";
  });
  insist(refused.includes("position"), `a pose without a place is taken: ${refused}`);
  await byHeldPointer(page);
  await page.evaluate(() => document.querySelector("belvedere-scene").remove());
  await byGamepad(page, `../${base.search}`);
  await byFinger(open, `../${base.search}`);
  const lost = await open(undefined, /status of 404|ERR_INTERNET_DISCONNECTED/);
  await lost.goto(new URL("embed/example.html", base).href);
  await lost.evaluate(() => document.querySelector("belvedere-scene").setAttribute("src", "../nowhere/?scene=none"));
  await lost.locator("belvedere-scene p").getByText("There is no scene called").waitFor({ timeout });
  // An element of a script, which has no link at first.
  await lost.evaluate(() => {
    document.querySelector("belvedere-scene").remove();
    document.body.append(document.createElement("belvedere-scene"));
  });
  await frames(lost);
  const late = `../${base.search}`;
  await ready(lost, "a link that came late", late);
  insist((await lost.evaluate(() => document.querySelector("belvedere-scene").src)) === late, "src is not told");
  // Without a line nothing comes, and with the line it does.
  await lost.context().setOffline(true);
  await lost.evaluate(
    (src) => document.querySelector("belvedere-scene").setAttribute("src", src),
    `${late}${base.search ? "&" : "?"}again`,
  );
  const line = lost.locator("belvedere-scene p");
  await line.getByText("cannot be reached").waitFor({ timeout });
  const back = ready(lost, "a line that came back");
  await lost.context().setOffline(false);
  await back;
  insist(!(await line.textContent()).includes("cannot be reached"), "a problem stays though it is over");
  console.log("one tag shows a world, and says so where it cannot");
});
