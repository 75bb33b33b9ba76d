import { expect, it } from "vitest";
import { explore, type SetUp } from "../test/explore.ts";
import { type Files, PITCH_M } from "../test/fixture.ts";
import type { Vec3 } from "./geometry.ts";

const FIRST_ROOM: Vec3 = [1.5, 1.6, 3];

const beginning = (files: Files, ...texts: string[]) =>
  [...files].filter(([, bytes]) => texts.some((text) => Buffer.from(bytes).toString().startsWith(text)));
const paths = (files: Files, ...texts: string[]) => beginning(files, ...texts).map(([path]) => path);

/** Where a walker stands still until all is there: which documents and files were asked for, in order. */
async function standing(at: Vec3, setUp: SetUp) {
  const set = await explore({ perChunk: 64, ...setUp });
  set.go(at);
  await set.quiet();
  const asked = (...texts: string[]) => set.requests.filter((path) => paths(set.files, ...texts).includes(path));
  return { ...set, asked };
}

it("shows all that can be seen from where one begins without a chunk of the index", async () => {
  const spoil = (files: Files) => paths(files, '{"objects"', '{"models"').forEach((path) => files.delete(path));
  const { explorer, problems } = await standing(FIRST_ROOM, { started: true, spoil });
  expect(problems).toEqual([]);
  expect(explorer).toMatchObject({ cellId: 0, settled: true, missing: 0, holes: 0 });
});

it("shows the same as without a start", async () => {
  const [started, indexed] = await Promise.all(
    [true, false].map((started) => standing(FIRST_ROOM, { started, populated: true, grown: true })),
  );
  expect(started?.explorer.visible).toEqual(indexed?.explorer.visible);
  expect([started, indexed].map((one) => one?.asked('{"cell":{').length)).toEqual([1, 0]);
});

it("asks for the cells next door after the first picture", async () => {
  const { requests, files, asked } = await standing(FIRST_ROOM, { started: true });
  const [cells] = asked('{"cells"');
  const first = requests.findIndex((path) => path.endsWith(".glb"));
  expect(first).toBeGreaterThan(0);
  expect(requests.indexOf(cells ?? "")).toBeGreaterThan(first);
  expect(paths(files, '{"cells"').length).toBe(1);
});

it("is not read by who begins elsewhere", async () => {
  const { explorer, asked } = await standing([1.5 + PITCH_M, 1.6, 3], { started: true });
  expect(explorer.cellId).toBe(2);
  expect(asked('{"cell":{')).toEqual([]);
});

it("is done without where it cannot be had", async () => {
  const spoil = (files: Files) => paths(files, '{"cell":{').forEach((path) => files.delete(path));
  const { explorer, problems } = await standing(FIRST_ROOM, { started: true, spoil });
  expect(problems).toEqual([]);
  expect(explorer).toMatchObject({ cellId: 0, settled: true, missing: 0 });
});
