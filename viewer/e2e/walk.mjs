/**
 * Does a person with a real browser get through a door? Waits until the first cell is loaded, walks from portal to portal
 * through a door and insists that the page shows the cell beyond, that the number of visible objects is that of its record,
 * that nothing was ever a hole and that nothing complained. Environment: see `browser.mjs`.
 */
import { insist, picture, settle, standing, state, tell, until, url } from "./browser.mjs";

/** Room for a walker beside the posts of a doorway. */
const PASSAGE_M = 0.6;
/** Openings up to this wide count as doors. */
const DOOR_M = 2.5;
/** Cells that are looked at for a way. */
const MOST_CELLS = 80;

const record = (page, cell) => page.evaluate((id) => window.belvedere.record(id), cell);

/** Where a walker passes a portal, when it is an upright opening that is wide enough. */
function passage({ polygon }, eyeHeight) {
  const axis = (i) => polygon.map((point) => point[i]);
  const extent = (i) => Math.max(...axis(i)) - Math.min(...axis(i));
  const middleOf = (i) => (Math.max(...axis(i)) + Math.min(...axis(i))) / 2;
  const upright = Math.min(...axis(1)) < eyeHeight && eyeHeight < Math.max(...axis(1)) && extent(1) > 0.3;
  const width = Math.hypot(extent(0), extent(2));
  return upright && width >= PASSAGE_M ? { centre: [middleOf(0), eyeHeight, middleOf(2)], width } : undefined;
}

const seen = (cell) => [...cell.lpvs, ...cell.opvs];
const along = (cell, axis) => cell.hull.points.map((point) => point[axis]);
const middle = (cell, axis) => (Math.min(...along(cell, axis)) + Math.max(...along(cell, axis))) / 2;
const size = (cell, axis) => Math.max(...along(cell, axis)) - Math.min(...along(cell, axis));

/**
 * A way through at least two portals, one of them no wider than a door, into a cell from which another number of objects
 * is visible; the nearest such, else the best there is. Cells are convex, so lines from portal to portal stay inside.
 */
async function chooseWay(page, from, eyeHeight) {
  const start = await record(page, from);
  const met = new Set([start.cell]);
  const open = [{ at: start, points: [], cells: [], narrow: false }];
  let best;
  for (let visited = 0; open.length > 0 && visited < MOST_CELLS; visited += 1) {
    const { at, points, cells, narrow } = open.shift();
    if (points.length >= 2 && size(at, 0) >= PASSAGE_M && size(at, 2) >= PASSAGE_M) {
      const changes = seen(at).length !== seen(start).length;
      const score = (narrow ? 2 : 0) + (changes ? 1 : 0);
      const goal = [middle(at, 0), eyeHeight, middle(at, 2)];
      if (!best || score > best.score) best = { points, cells, goal, changes, score, expected: seen(at).length };
      if (score === 3) return best;
    }
    for (const portal of at.portals) {
      const passed = passage(portal, eyeHeight);
      if (!passed || met.has(portal.to)) continue;
      met.add(portal.to);
      open.push({
        at: await record(page, portal.to),
        points: [...points, passed.centre],
        cells: [...cells, `c${portal.to}`],
        narrow: narrow || portal.door !== undefined || passed.width <= DOOR_M,
      });
    }
  }
  insist(best, `from ${from} no portal leads on to a second cell at eye height ${eyeHeight.toFixed(2)} m`);
  return best;
}

/** Watches for holes from now on: what is held must be drawn all the time. */
function watchForHoles(page) {
  return page.evaluate(() => {
    window.worstHoles = 0;
    setInterval(() => {
      window.worstHoles = Math.max(window.worstHoles, window.belvedere.state().holes);
    }, 50);
  });
}

/** In the page: lets W go as soon as one is in another cell; a slow browser would hear of that some steps later. */
function letGoBehind(cell) {
  const look = () => {
    if (window.belvedere.state().cell === cell) requestAnimationFrame(look);
    else dispatchEvent(new KeyboardEvent("keyup", { code: "KeyW" }));
  };
  look();
}

/** Turns towards a point and holds W until the displayed cell changes. */
async function walkByKey(page, target, from) {
  const { position } = await state(page);
  const yaw = Math.atan2(-(target[0] - position[0]), -(target[2] - position[2]));
  await page.evaluate(([p, angle]) => window.belvedere.teleport(p, angle, 0), [position, yaw]);
  await page.locator("#view").focus();
  await page.evaluate(letGoBehind, from);
  await page.keyboard.down("KeyW");
  const isElsewhere = (cell) => window.belvedere.state().cell !== cell;
  await until(page, `holding W does not lead out of ${from} towards ${target}`, isElsewhere, from);
  await page.keyboard.up("KeyW");
  await standing(page);
}

async function walkTo(page, target) {
  const arrived = await page.evaluate((point) => window.belvedere.walkTo(point, 2), target);
  const { position, cell } = await state(page);
  insist(arrived, `the walker is stuck at ${position} in ${cell} on the way to ${target}`);
}

async function walk(open) {
  const page = await open();
  await page.goto(url);
  const start = await settle(page, "the first cell");
  insist(start.cell !== null, "no cell is displayed");
  await page.screenshot({ path: picture("1-start") });
  await watchForHoles(page);
  const way = await chooseWay(page, start.cell, start.position[1]);
  const to = way.cells.at(-1);
  console.log(`walking ${[start.cell, ...way.cells].join(" → ")}`);

  await walkByKey(page, way.points[0], start.cell);
  const between = await settle(page, "the cell behind the first portal");
  // A slow browser takes long steps and may pass a thin doorway in one of them.
  const reached = way.cells.slice(0, 2).includes(between.cell);
  insist(reached, `expected ${way.cells[0]} behind the first portal, not ${between.cell}`);
  await page.screenshot({ path: picture("2-doorway") });

  for (const point of [...way.points.slice(1), way.goal]) await walkTo(page, point);
  const end = await settle(page, "the cell beyond");
  insist(end.cell === to, `the walker is in ${end.cell} where ${to} is expected`);
  const says = ([id, start]) => document.querySelector(`[data-testid=${id}]`).textContent.startsWith(start);
  await until(page, `the page does not show ${to}`, says, ["cell", to]);
  const counted = `${end.visible} of ${end.objects} `;
  await until(page, `the page does not say "${counted}"`, says, ["visible", counted]);
  const visible = await page.getByTestId("visible").textContent();
  const bytes = await page.getByTestId("bytes").textContent();
  await page.screenshot({ path: picture("3-beyond") });
  const whole = start.visible === start.objects && end.visible === end.objects;
  const expected = whole ? end.objects : way.expected;
  insist(end.visible === expected, `${end.visible} objects are shown where the record of ${to} lists ${expected}`);
  insist(!way.changes || whole || end.visible !== start.visible, "the number of visible objects did not change");
  insist(/^[\d.]+ [kMG]?B of /.test(bytes), `the page says "${bytes}"`);
  const worstHoles = await page.evaluate(() => window.worstHoles);
  insist(worstHoles === 0, `on the way ${worstHoles} objects were held but not drawn`);
  insist(end.problems.length === 0, `the viewer reports: ${end.problems.join("; ")}`);
  console.log(`arrived in ${to}: ${visible}, ${bytes}`);
}

await tell("walk", walk);
