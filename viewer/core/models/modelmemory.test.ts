import { expect, it } from "vitest";
import type { Grade } from "../strategy/grade.ts";
import { NO_PICTURES } from "../strategy/pictures.ts";
import type { Cause, Want } from "../strategy/priority.ts";
import { ResidencySet } from "../strategy/residency.ts";
import { ModelMemory, type ModelMemoryParts } from "./modelmemory.ts";

const LEVELS = [0, 1].map((number) => ({ url: `l${number}.glb`, bytes: 1000, textures: [] }));
const grade = (number: number): Grade => ({ kind: "level", number, triangles: 1, geometricError: number });

function want(model: number, cause: Cause): Want {
  return { object: { model: { model, levels: LEVELS } }, grade: grade(0), cause, priority: 0 } as unknown as Want;
}

it("has no memory for what went while it was near, but for what takes the place of something useless", () => {
  const residency = new ResidencySet(1e6);
  const memory = new ModelMemory({ residency } as unknown as ModelMemoryParts);
  for (const model of [1, 2]) residency.hold(model, "base", { grade: grade(1), bytes: 3e5, pictures: NO_PICTURES });
  residency.hold(1, "detail", { grade: grade(0), bytes: 3e5, pictures: NO_PICTURES });
  residency.need(new Set([1, 2]));
  const gone = residency.promise(3, 3e5, { spare_bytes: 0, within_steps: 0, sharp_within_steps: -1 });
  expect(gone).toEqual({ details: [1], models: [] });
  residency.withdraw(3);

  const granted = (...wants: Want[]) => memory.affordable(wants).map(({ object }) => object.model.model);
  const finer: Cause = { kind: "finer", error_px: 9 };
  expect(granted(want(1, finer), want(2, finer))).toEqual([2]);
  expect(granted(want(1, { kind: "finer", error_px: Number.MAX_VALUE }))).toEqual([1]);
  residency.need(new Set());
  residency.need(new Set([1, 2]));
  expect(granted(want(1, finer))).toEqual([1]);
});

it("has memory for what is coarser in place of what takes nearly all of it, and for nothing else then", () => {
  const residency = new ResidencySet(1e6);
  const memory = new ModelMemory({ residency } as unknown as ModelMemoryParts);
  // It turned out larger than was promised.
  residency.hold(1, "base", { grade: grade(0), bytes: 1_200_000, pictures: NO_PICTURES });
  residency.need(new Set([1, 2]));
  const granted = (...wants: Want[]) => memory.affordable(wants).map(({ object }) => object.model.model);
  const missing: Cause = { kind: "missing" };
  expect([granted(want(2, missing)), memory.short]).toEqual([[], true]);
  expect([granted(want(1, { kind: "coarser" }), want(2, missing)), memory.short]).toEqual([[1], true]);
  residency.hold(1, "base", { grade: grade(1), bytes: 5000, pictures: NO_PICTURES });
  expect([granted(want(2, missing)), memory.short]).toEqual([[2], false]);
});
