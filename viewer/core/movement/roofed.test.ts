import { expect, it } from "vitest";
import type { PublishedScene } from "../atlas/published.ts";
import type { Bounds, Vec3 } from "../basics/geometry.ts";
import type { CellEntry } from "../documents/documents.ts";
import { isRoofed } from "./roofed.ts";

/** Nobody waits for it. */
const LONG = new Promise<void>(() => {});
const WORLD: Bounds = { min: [0, 0, 0], max: [20, 6, 20] };

function cell(id: number, min: Vec3, max: Vec3, ...adjacent: number[]): CellEntry {
  return { cell: id, bounds: { min, max }, planes: [], adjacent, record: "", recordBytes: 0, steps: undefined };
}

/** A world whose bake would begin in c0, under the middle of it. */
function world(cells: readonly CellEntry[], isMadeUp = true, cellChunk = async () => [...cells]): PublishedScene {
  const top = Math.max(...cells.map(({ bounds }) => bounds.max[1]));
  const chunk = { kind: "chunk", url: "/o/a", bytes: 1, first: 0, count: cells.length };
  const entries = [{ ...chunk, bounds: { min: WORLD.min, max: [20, top, 20] } }];
  const viewpoints = [{ name: "start", position: [5, 1.6, 5], orientation: [0, 0, 0, 1], cell: 0, isMadeUp }];
  return { manifest: { bounds: WORLD, cells: { entries }, viewpoints }, cellChunk } as unknown as PublishedScene;
}

const room = (...adjacent: number[]) => cell(0, [1, 0, 1], [9, 3, 9], ...adjacent);
const nextRoom = cell(1, [9, 0, 1], [19, 3, 9], 0);
const sky = cell(2, [-2, 6, -2], [22, 9, 22]);

it("there is a roof over a room from which no cell leads up, although one could fly over it", async () => {
  expect(await isRoofed(world([room(1), nextRoom, sky]), WORLD, LONG)).toBe(true);
});

it("there is none over a street, however many cells it is cut into upwards", async () => {
  const over = cell(1, [-2, 3, -2], [22, 6, 22], 0, 2);
  expect(await isRoofed(world([room(1), over, { ...sky, adjacent: [1] }]), WORLD, LONG)).toBe(false);
  expect(await isRoofed(world([cell(0, [1, 0, 1], [9, 9, 9])]), WORLD, LONG)).toBe(false);
});

it("what is open above next door is no sky over here", async () => {
  const court = cell(1, [9, 0, 1], [19, 9, 9], 0);
  expect(await isRoofed(world([room(1), court]), WORLD, LONG)).toBe(true);
});

it("nothing is asked where an author says where to begin, or nobody could fly over it", async () => {
  const never = () => expect.fail("asked");
  expect(await isRoofed(world([room(), sky], false, never), WORLD, LONG)).toBe(false);
  expect(await isRoofed(world([room(1), nextRoom], true, never), WORLD, LONG)).toBe(false);
});

it("what cannot be had says nothing of a roof", async () => {
  expect(
    await isRoofed(
      world([room(), sky], true, () => Promise.reject(new Error("lost"))),
      WORLD,
      LONG,
    ),
  ).toBe(false);
});

it("what is silent until it is enough says nothing of a roof", async () => {
  const silent = () => new Promise<never>(() => {});
  expect(await isRoofed(world([room(), sky], true, silent), WORLD, Promise.resolve())).toBe(false);
});
