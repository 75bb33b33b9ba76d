import { expect, it } from "vitest";
import { Company } from "./company.ts";
import { readEvent } from "./events.ts";

const FIRST = 100_000_001;

/** A company, and whoever tells it of events. */
function listening() {
  const company = new Company("r");
  const tell = (name: Parameters<typeof readEvent>[0], data: unknown, now_ms = 0) => {
    const event = readEvent(name, JSON.stringify(data));
    if (event) company.take(event, now_ms);
  };
  return { company, tell };
}

const at = (t_ms: number, x: number) => ({
  t_ms,
  position: [x, 0, 0],
  orientation: [0, 0, 0, 1],
  velocity: [1, 0, 0],
});

const info = (mover: number, pose = at(0, 0)) => ({
  object: `o${mover}`,
  source_node: "Ada",
  pose,
  radius_m: 0.5,
  period_ms: 100,
});

const gone = (mover: number, reason: string) => ({ objects: [`o${mover}`], reason });

const moved = (...movers: number[]) => ({
  t_ms: 0,
  objects: movers.map((mover) => ({ object: `o${mover}`, ...at(0, 3) })),
});

it("a company is what the events add up to, in one's own time", () => {
  const { company, tell } = listening();
  tell("hello", { now_ms: 1_000_000, extrapolate_ms: 2000, revision: "r" }, 500);
  tell("object-info", info(FIRST, at(1_000_000, 3)), 500);
  tell("object-info", { object: "o7", source_node: "a chair" }, 500);
  expect(company.movers(1500)).toMatchObject([
    { object: 100_000_001, name: "Ada", position: [4, 0, 0], period_ms: 100 },
  ]);
  tell("rate", { objects: [{ object: "o100000001", period_ms: 800 }] }, 1500);
  expect(company.movers(1500)[0]?.period_ms).toBe(800);
  tell("object-gone", { objects: ["o100000001"], reason: "hidden" }, 1500);
  expect(company.movers(1500)).toEqual([]);
  tell("object-pos", { t_ms: 1_002_000, objects: [{ object: "o100000001", ...at(1_002_000, 9) }] }, 2500);
  expect(company.movers(2500)).toMatchObject([{ name: "Ada", position: [9, 0, 0] }]);
  tell("door", { object: "o5", open: false }, 2500);
  expect([...company.closedDoors]).toEqual([5]);
  tell("door", { object: "o5", open: true }, 2500);
  expect([...company.closedDoors]).toEqual([]);
  tell("door", { object: "o6", open: false }, 2500);
  tell("revision", { revision: "0011223344556677" }, 2500);
  expect([...company.closedDoors]).toEqual([]);
  tell("resync", { reason: "missed" }, 2500);
  expect(company.movers(2500)).toEqual([]);
});

it("once nothing is heard for a while nobody is seen, but doors stay as they are", () => {
  const { company, tell } = listening();
  tell("hello", { now_ms: 0, extrapolate_ms: 2000, revision: "r" });
  for (const mover of [FIRST, FIRST + 1]) tell("object-info", info(mover));
  tell("object-gone", gone(FIRST, "hidden"));
  tell("door", { object: "o5", open: false });
  company.take({ kind: "silence" }, 0);
  tell("object-pos", moved(FIRST, FIRST + 1));
  expect([company.movers(0), [...company.closedDoors]]).toEqual([[], [5]]);
});

it("doors of another revision than one walks through are none, and those of that one are open", () => {
  const { company, tell } = listening();
  const hello = (revision: string) => tell("hello", { now_ms: 0, extrapolate_ms: 2000, revision });
  hello("r");
  tell("door", { object: "o5", open: false });
  tell("revision", { revision: "s" });
  tell("door", { object: "o7", open: false });
  expect([company.isCurrent, [...company.closedDoors]]).toEqual([false, []]);
  tell("revision", { revision: "r" });
  tell("door", { object: "o6", open: false });
  hello("r");
  expect([company.isCurrent, [...company.closedDoors]]).toEqual([true, [6]]);
  // It was published anew while nothing was heard.
  hello("s");
  tell("door", { object: "o8", open: false });
  expect([company.isCurrent, [...company.closedDoors]]).toEqual([false, []]);
});

it("whoever was hidden comes back without an info, and who left does not", () => {
  const { company, tell } = listening();
  const reasons = ["hidden", "left", "destroyed"];
  reasons.forEach((_, i) => void tell("object-info", info(FIRST + i)));
  reasons.forEach((reason, i) => void tell("object-gone", gone(FIRST + i, reason)));
  expect(company.movers(0)).toEqual([]);
  tell("object-pos", moved(FIRST, FIRST + 1, FIRST + 2));
  expect(company.movers(0).map(({ object }) => object)).toEqual([FIRST]);
});

it("who hides is remembered, however many have left since", () => {
  const { company, tell } = listening();
  tell("object-info", info(FIRST));
  for (let mover = FIRST + 1; mover <= FIRST + 300; mover += 1) {
    tell("object-info", info(mover));
    tell("object-gone", gone(mover, "left"));
  }
  tell("object-gone", gone(FIRST, "hidden"));
  tell("object-info", info(FIRST + 301));
  tell("object-pos", moved(FIRST));
  expect(company.movers(0).map(({ object }) => object)).toContain(FIRST);
});

it("the longest hidden are forgotten, not those who were met first", () => {
  const { company, tell } = listening();
  tell("object-info", info(FIRST));
  for (let mover = FIRST + 1; mover <= FIRST + 256; mover += 1) {
    tell("object-info", info(mover));
    tell("object-gone", gone(mover, "hidden"));
  }
  tell("object-gone", gone(FIRST, "hidden"));
  tell("object-pos", moved(FIRST, FIRST + 1, FIRST + 2));
  expect(company.movers(0).map(({ object }) => object)).toEqual([FIRST, FIRST + 2]);
});

it("after a sleep in which one's own clock stood still, people are seen as late as they are heard of", () => {
  const { company, tell } = listening();
  tell("hello", { now_ms: 1000, extrapolate_ms: 2000, revision: "r" }, 0);
  tell("object-info", info(FIRST, at(1000, 0)), 50);
  // Half a minute later for the server, and no time at all here.
  tell("object-pos", { t_ms: 31_000, objects: [{ object: `o${FIRST}`, ...at(31_000, 9) }] }, 100);
  const x_at = (now_ms: number) => company.movers(now_ms)[0]?.position[0];
  expect(x_at(1100)).toBeCloseTo(10);
  // What comes later than the quickest changes nothing.
  tell("object-pos", { t_ms: 31_100, objects: [{ object: `o${FIRST}`, ...at(31_100, 9.1) }] }, 900);
  expect(x_at(1100)).toBeCloseTo(10);
});
