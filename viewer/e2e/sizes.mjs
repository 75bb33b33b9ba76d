/**
 * Does the page suit worlds of any size? Opens one of 10 cm and one of kilometres: whoever begins high up is told that one flies,
 * and how to come down; the map shows all of the world, and is zoomed with keys, its buttons, a wheel and two fingers, between
 * that and a small cell. `BELVEDERE_URL` names a tree that has the scenes `model` and `land` (`e2e/worlds`). Environment: see
 * `browser.mjs`.
 */
import { addressOf, atRest, drawn, frames, insist, picture, settle, state, tell, timeout, until } from "./browser.mjs";

const WORLDS = [
  { scene: "model", width_m: 0.1, unit: "cm" },
  { scene: "land", width_m: 6000, unit: "km" },
];
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 };
const METRES = { mm: 1e-3, cm: 1e-2, m: 1, km: 1e3 };
/** More than it takes from the whole world to a small cell. */
const MANY = 30;

const button = (page, name) => page.getByRole("button", { name, exact: true });

/** How much of the world the map says that it shows, once that stays the same. */
async function shown(page) {
  const label = await atRest(page, "the map", () => document.querySelector("#map canvas").getAttribute("aria-label"));
  const [, number, unit] = label.match(/^Map, ([\d.]+) (\w+) across\./) ?? [];
  insist(unit in METRES, `the map says "${label}"`);
  return { width_m: Number(number) * METRES[unit], unit, label };
}

/** Insists that the first hint is true. */
async function told(page, scene, verb) {
  await until(page, `${scene}: one does not ${verb}`, (mode) => window.belvedere.state().mode === mode, verb);
  const hint = await page.locator("#intro").innerText();
  const other = verb === "fly" ? "walk" : "fly";
  insist(hint.includes(verb) && !hint.includes(other), `${scene}: who can ${verb} is told "${hint}"`);
  const spoken = await page.locator("#how").innerText();
  insist(spoken.toLowerCase().startsWith(verb), `${scene}: a screen reader says "${spoken}" to who can ${verb}`);
}

async function comeDown(page, scene) {
  await told(page, scene, "fly");
  await page.keyboard.press("KeyF");
  await told(page, scene, "walk");
  await page.keyboard.press("KeyF");
  await told(page, scene, "fly");
}

async function zoom(page, { scene, width_m, unit }) {
  await page.keyboard.press("KeyM");
  await page.locator("#map canvas[aria-label]").waitFor({ timeout });
  await drawn(page);
  await page.screenshot({ path: picture(`sizes-${scene}-map`) });
  const whole = await shown(page);
  const isFramed = whole.width_m >= width_m && whole.width_m <= 2 * width_m && whole.unit === unit;
  insist(isFramed, `${scene}: a world of ${width_m} m fills a map of ${whole.width_m} m`);
  await page.locator("#map canvas").focus();
  for (let i = 0; i < MANY; i += 1) await page.keyboard.press("-");
  const all = await shown(page);
  insist(
    all.width_m >= whole.width_m,
    `${scene}: the whole world of ${all.width_m} m is less than ${whole.width_m} m of it`,
  );
  const nearer = async (how, act, from) => {
    await act();
    const isOther = (label) => document.querySelector("#map canvas").getAttribute("aria-label") !== label;
    await until(page, `${scene}: ${how} does nothing`, isOther, from.label);
    const now = await shown(page);
    insist(now.width_m < from.width_m, `${scene}: ${how} does not zoom: ${now.width_m} m of ${from.width_m} m`);
    return now;
  };
  const clicked = await nearer("its button", () => button(page, "Zoom in").click(), all);
  await page.locator("#map canvas").hover();
  const wheeled = await nearer("the wheel", () => page.mouse.wheel(0, -100), clicked);
  await page.locator("#map canvas").focus();
  const pressed = await nearer("a key", () => page.keyboard.press("+"), wheeled);
  for (let i = 0; i < MANY; i += 1) await page.keyboard.press("+");
  const least = await shown(page);
  insist(least.width_m < pressed.width_m, `${scene}: the map ends at ${least.width_m} m`);
  await page.keyboard.press("+");
  insist((await shown(page)).width_m === least.width_m, `${scene}: the map has no end`);
  insist(least.width_m > whole.width_m / 5000 && least.width_m < 10, `${scene}: a small cell has ${least.width_m} m`);
  await page.screenshot({ path: picture(`sizes-${scene}-near`) });
  const end = await button(page, "Zoom in").getAttribute("aria-disabled");
  insist(end === "true", `${scene}: the button promises more than there is`);
  for (let i = 0; i < MANY; i += 1) await page.keyboard.press("-");
  insist((await shown(page)).width_m === all.width_m, `${scene}: one does not get back to the whole world`);
  const far = await button(page, "Zoom out").getAttribute("aria-disabled");
  insist(far === "true", `${scene}: the button promises more than there is`);
}

/** Moves two fingers apart over the map; that is not a tap, which would lead elsewhere. */
async function pinch(page, { scene }) {
  await button(page, "Map").tap();
  await page.locator("#map canvas[aria-label]").waitFor({ timeout });
  await drawn(page);
  const box = await page.locator("#map canvas").boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const before = [await shown(page), await state(page)];
  const session = await page.context().newCDPSession(page);
  const touch = (type, apart_px) =>
    session.send("Input.dispatchTouchEvent", {
      type,
      touchPoints:
        type === "touchEnd"
          ? []
          : [
              { x: x - apart_px, y, id: 1 },
              { x: x + apart_px, y, id: 2 },
            ],
    });
  await touch("touchStart", 20);
  for (const apart_px of [30, 45, 60]) await touch("touchMove", apart_px);
  await touch("touchEnd");
  await frames(page);
  await page.screenshot({ path: picture(`sizes-${scene}-pinched`) });
  const after = [await shown(page), await state(page)];
  const factor = before[0].width_m / after[0].width_m;
  insist(factor > 2 && factor < 4, `${scene}: three times as far apart, two fingers zoom by ${factor}`);
  insist(String(before[1].position) === String(after[1].position), `${scene}: two fingers on the map lead elsewhere`);
}

await tell("sizes", async (open) => {
  for (const world of WORLDS) {
    const page = await open();
    await page.goto(addressOf(world.scene));
    await settle(page, world.scene);
    await comeDown(page, world.scene);
    await zoom(page, world);
    await page.close();
    const phone = await open(PHONE);
    await phone.goto(addressOf(world.scene));
    await settle(phone, `${world.scene} on a phone`);
    await told(phone, world.scene, "fly");
    await pinch(phone, world);
    await phone.close();
  }
  console.log("worlds of 10 cm and of 6 km open flying, which the page says, and fit on the map");
});
