import { expect, it } from "vitest";
import { explore, type SetUp } from "../../test/explore.ts";
import { type Files, PITCH_M } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";

const FIRST_ROOM: Vec3 = [1.5, 1.6, 3];

/** Documents that begin with one of these texts. */
const paths = (files: Files, ...texts: string[]) => {
  const documents = [...files].map(([path, bytes]) => ({ path, text: Buffer.from(bytes).toString() }));
  return documents.filter(({ text }) => texts.some((start) => text.startsWith(start))).map(({ path }) => path);
};
const drop = (files: Files, ...texts: string[]) => {
  for (const path of paths(files, ...texts)) files.delete(path);
};

/** Where a walker stands still until all is there: which documents and files were asked for, in order. */
async function standing(at: Vec3, setUp: SetUp) {
  const set = await explore({ perChunk: 64, ...setUp });
  set.go(at);
  await set.quiet();
  const asked = (...texts: string[]) => set.requests.filter((path) => paths(set.files, ...texts).includes(path));
  return { ...set, asked };
}

it("shows all that can be seen from where one begins without a chunk of the index", async () => {
  const spoil = (files: Files) => drop(files, '{"objects"', '{"models"');
  const { explorer, problems } = await standing(FIRST_ROOM, { started: true, spoil });
  expect(problems).toEqual([]);
  expect(explorer).toMatchObject({ cellId: 0, settled: true, missing: 0, holes: 0 });
});

it("shows the same as without a start", async () => {
  const [started, indexed] = await Promise.all(
    [true, false].map((started) => standing(FIRST_ROOM, { started, populated: true, grown: true })),
  );
  expect(started?.explorer.visible).toEqual(indexed?.explorer.visible);
  expect([started, indexed].map((one) => one?.asked('{"start"').length)).toEqual([1, 0]);
});

it("knows what can be seen from the room behind the next doorway too", async () => {
  const spoil = (files: Files) => drop(files, '{"cells"', '{"objects"', '{"models"');
  const { explorer, problems, go, quiet } = await standing(FIRST_ROOM, { started: true, rooms: 2, spoil });
  go([1.5 + PITCH_M, 1.6, 3]);
  await quiet();
  expect(problems).toEqual([]);
  expect(explorer).toMatchObject({ cellId: 2, settled: true, missing: 0, holes: 0 });
});

it("is not read by who begins elsewhere", async () => {
  const { explorer, asked } = await standing([1.5 + PITCH_M, 1.6, 3], { started: true });
  expect(explorer.cellId).toBe(2);
  expect(asked('{"start"')).toEqual([]);
});

it("is asked for once by who stands where no cell is known either", async () => {
  let starts: string[] = [];
  const spoil = (files: Files) => {
    starts = paths(files, '{"start"');
    drop(files, '{"start"', '{"cells"');
  };
  const { explorer, go, quiet, requests } = await explore({ perChunk: 64, started: true, spoil });
  const asked = () => requests.filter((path) => starts.includes(path)).length;
  for (let frame = 0; frame < 20; frame += 1) {
    go([...FIRST_ROOM]);
    await quiet();
  }
  expect(asked()).toBe(1);
  explorer.retry();
  await quiet();
  expect(asked()).toBe(2);
});

it("is done without where it cannot be had", async () => {
  const spoil = (files: Files) => drop(files, '{"start"');
  const { explorer, problems } = await standing(FIRST_ROOM, { started: true, spoil });
  expect(problems).toEqual([]);
  expect(explorer).toMatchObject({ cellId: 0, settled: true, missing: 0 });
});
