/**
 * Is a crowd drawn at once? Some hundred people walk in circles over a square; however many they are, they are four draw calls:
 * those near by, those far away, those who wear the model of a statue, and the shades at their feet. `BELVEDERE_URL` names a server that has the scene `square` (`e2e/worlds`).
 * Environment: see `browser.mjs`.
 */
import { addressOf, drawn, frames, insist, picture, settle, state, tell, until } from "./browser.mjs";
import { objectCalled, removeMovers } from "./live.mjs";

const PEOPLE = Number(process.env.BELVEDERE_CROWD ?? 120);
const [CORNERS, SPEED_MPS] = [12, 1.3];
/** How long they turn at a corner. */
const TURN_MS = 120;
const EYES_M = 1.65;
/** Draw calls that people may add, however many there are. */
const MOST_CALLS = 4;
/** Every so many wears the statue's model. */
const WEARS = 4;

/** A walk around a place, along straight lines, and back to where it began. */
function circle(number) {
  const golden = number * 2.399963;
  const away_m = 2 + 28 * Math.sqrt((number + 0.5) / PEOPLE);
  const [x, z, radius_m] = [away_m * Math.cos(golden), 8 + away_m * Math.sin(golden), 2 + (number % 5)];
  const keys = [];
  let t_ms = 0;
  const side_m = 2 * radius_m * Math.sin(Math.PI / CORNERS);
  for (let i = 0; i <= CORNERS; i += 1) {
    const angle = golden + (2 * Math.PI * i) / CORNERS;
    const position = [x + radius_m * Math.cos(angle), EYES_M, z + radius_m * Math.sin(angle)];
    for (const before of [1, 0]) {
      const ahead = angle + Math.PI / 2 + (Math.PI / CORNERS) * (1 - 2 * before);
      const yaw = Math.atan2(-Math.cos(ahead), -Math.sin(ahead));
      keys.push({ t_ms: Math.round(t_ms), position, orientation: [0, Math.sin(yaw / 2), 0, Math.cos(yaw / 2)] });
      if (before) t_ms += TURN_MS;
    }
    t_ms += (1000 * side_m) / SPEED_MPS;
  }
  return { trajectory: { keys, repeat: true } };
}

await tell("crowd", async (open) => {
  const page = await open();
  const address = addressOf("square");
  await page.goto(address);
  await settle(page, "the square");
  const nobody = () => window.belvedere.state().people.length === 0;
  // Who has left without a word is there for a while.
  await until(page, "people are here before any came", nobody);
  await drawn(page);
  const alone = await state(page);
  const statue = await objectCalled(page, address, "statue");
  const movers = new URL("/v1/scenes/square/movers", address);
  const made = await Promise.all(
    Array.from({ length: PEOPLE }, async (_, i) => {
      const data = { ...circle(i), ...(i % WEARS === 0 ? { avatar: statue } : {}) };
      return (await page.request.post(movers.href, { data })).json();
    }),
  );
  insist(
    made.every(({ object }) => object),
    `a mover was refused: ${JSON.stringify(made.find(({ object }) => !object))}`,
  );
  await until(page, "few people are here", (n) => window.belvedere.state().people.length > n / 2, PEOPLE);
  const areDrawn = ([n, most]) => window.belvedere.state().drawCalls - n === most;
  await until(page, `people are not ${MOST_CALLS} draw calls`, areDrawn, [alone.drawCalls, MOST_CALLS]);
  const among = await state(page);
  const calls = among.drawCalls - alone.drawCalls;
  const triangles = among.triangles - alone.triangles;
  console.log(`${among.people.length} people: ${calls} draw calls and ${triangles} triangles`);
  await page.screenshot({ path: picture("crowd") });
  const { position } = among;
  await page.evaluate((p) => window.belvedere.walkTo(p, 8), [position[0], position[1], position[2] - 30]);
  await frames(page);
  await page.screenshot({ path: picture("crowd-among") });
  await removeMovers(page, made);
  await until(page, "people stay who were taken away", nobody);
});
