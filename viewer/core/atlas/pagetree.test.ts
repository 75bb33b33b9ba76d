import { expect, it } from "vitest";
import type { PageEntry } from "../documents/documents.ts";
import { byChunk } from "./pagetree.ts";

const chunk = (first: number, count: number) => ({ kind: "chunk", first, count }) as PageEntry;

it("puts ids to the chunks in which they lie", () => {
  const chunks = [chunk(10, 5), chunk(0, 4), chunk(15, 0xffff_ffff)];
  const found = byChunk(chunks, [14, 3, 4, 9, 10, 15, 0, 0xffff_fffe]);
  expect(chunks.map((one) => found.get(one))).toEqual([
    [14, 10],
    [3, 0],
    [15, 0xffff_fffe],
  ]);
  expect(byChunk([], [1])).toEqual(new Map());
  expect(byChunk(chunks.slice(0, 1), [9, 15])).toEqual(new Map());
});

it("looks at few chunks for each id, however many there are", () => {
  let looks = 0;
  const counting = (first: number) => ({
    ...chunk(first, 10),
    get first() {
      looks += 1;
      return first;
    },
  });
  const chunks = Array.from({ length: 1000 }, (_, i) => counting(10 * i));
  const ids = Array.from({ length: 10_000 }, (_, id) => id);
  const found = byChunk(chunks, ids);
  expect([...found.values()].flat().sort((a, b) => a - b)).toEqual(ids);
  expect(looks).toBeLessThan(ids.length * 12 + chunks.length * 30);
});
