import { expect, it } from "vitest";
import { placedAhead } from "../../test/placed.ts";
import type { CellRecords } from "../atlas/cellrecords.ts";
import type { ObjectDirectory } from "../atlas/objects.ts";
import type { KnownCells } from "../strategy/ahead.ts";
import { LookAhead } from "./lookahead.ts";

/** Two cells side by side, and what can be seen from the second, which may change. */
function nextDoor(seen: () => readonly number[]) {
  const cells = {
    entryOf: (cell: number) => ({
      cell,
      bounds: { min: [4 * cell, 0, 0], max: [4 * cell + 4, 3, 4] },
      adjacent: [1 - cell],
    }),
    recordOf: () => undefined,
  } as unknown as KnownCells;
  const records = { read: async (cell: number) => ({ cell }), seenFrom: seen } as unknown as CellRecords;
  const behold = async (ids: readonly number[]) => ({ objects: ids.map((id) => placedAhead(id, id, 1, [0])) });
  let told = 0;
  const ahead = new LookAhead(records, { behold } as unknown as ObjectDirectory, cells, () => {
    told += 1;
  });
  const learn = () => {
    ahead.look(0, [2, 1.6, 2], [1, 0, 0]);
    ahead.learn(1e6);
  };
  const known = () => ahead.known.map(({ objects }) => objects.map(({ entry }) => entry.object));
  return { ahead, learn, known, told: () => told };
}

const turn = () => new Promise((resolve) => setTimeout(resolve, 0));

it("what can be seen from a cell ahead is learnt once", async () => {
  const { learn, known, told } = nextDoor(() => [7, 8]);
  learn();
  expect(known()).toEqual([]);
  await turn();
  learn();
  await turn();
  expect([known(), told()]).toEqual([[[7, 8]], 1]);
});

it("what is learnt anew serves until then, so that nothing that comes for it is called off", async () => {
  let seen = [7, 8];
  const { ahead, learn, known } = nextDoor(() => seen);
  learn();
  await turn();
  seen = [7];
  ahead.renew();
  expect(known()).toEqual([[7, 8]]);
  learn();
  expect(known()).toEqual([[7, 8]]);
  await turn();
  expect(known()).toEqual([[7]]);
});
