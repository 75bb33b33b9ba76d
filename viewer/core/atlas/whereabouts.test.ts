import { expect, it, vi } from "vitest";
import type { Vec3 } from "../basics/geometry.ts";
import type { CellEntry } from "../documents/documents.ts";
import type { CellIndex } from "./cellindex.ts";
import { Whereabouts } from "./whereabouts.ts";

it("tells when the index has answered, though the eye is still nearest to the same cell", async () => {
  const entry = { cell: 7 } as CellEntry;
  let distance_m = 0;
  const index = { nextDoor: () => undefined, locate: async () => ({ entry, distance_m }) } as unknown as CellIndex;
  const entered = vi.fn();
  const told: { locating: boolean; inside: boolean }[] = [];
  const whereabouts = new Whereabouts(index, {
    entered,
    located: () => told.push({ locating: whereabouts.locating, inside: whereabouts.inside }),
    outside: () => {},
    nowhere: () => {},
    problem: () => {},
  });
  whereabouts.follow([0, 0, 0]);
  await vi.waitFor(() => expect(told.at(-1)).toEqual({ locating: false, inside: true }));
  distance_m = 3;
  whereabouts.follow([0, 9, 0]);
  expect(whereabouts.locating).toBe(true);
  await vi.waitFor(() => expect(told.at(-1)).toEqual({ locating: false, inside: false }));
  expect(entered).toHaveBeenCalledTimes(1);
});

it("asks again for whoever has gone elsewhere meanwhile, be it by centimetres", async () => {
  const cells = [{ cell: 0 } as CellEntry, { cell: 1 } as CellEntry];
  const border_m = 0.05;
  const index = {
    nextDoor: () => undefined,
    locate: async ([x]: Vec3) => ({ entry: cells[x < border_m ? 0 : 1], distance_m: 0 }),
  } as unknown as CellIndex;
  const events = { entered: () => {}, located: () => {}, outside: () => {}, nowhere: () => {}, problem: () => {} };
  const whereabouts = new Whereabouts(index, events);
  whereabouts.follow([0.01, 0, 0]);
  whereabouts.follow([0.09, 0, 0]);
  await vi.waitFor(() => expect(whereabouts.locating).toBe(false));
  expect(whereabouts.cell).toBe(cells[1]);
});
