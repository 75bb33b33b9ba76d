import { expect, it } from "vitest";
import { explore } from "../../test/explore.ts";
import { HEIGHT_M, PITCH_M } from "../../test/fixture.ts";
import { dropTo } from "../basics/convex.ts";
import type { Vec3 } from "../basics/geometry.ts";
import { EYE_HEIGHT_M } from "../basics/person.ts";

const BODY = { bodyRadius_m: 0.22, standing_m: EYE_HEIGHT_M };

it("who comes down stands on the ground below, whatever is nearer", async () => {
  const { explorer, go } = await explore({ rooms: 24, perChunk: 2 });
  const eye: Vec3 = [10 * PITCH_M + 1, 40, 2];
  go(eye);
  const footing = await explorer.footing(eye, BODY);
  expect(footing?.cell).toBe(20);
  expect(footing?.position.map((x) => Number(x.toFixed(3)))).toEqual([eye[0], EYE_HEIGHT_M, 2]);
  explorer.close();
});

it("who is in a room comes down to its floor, off its walls", async () => {
  const { explorer, go, quiet } = await explore();
  const eye: Vec3 = [0.05, HEIGHT_M - 0.1, 3];
  go(eye);
  await quiet();
  const footing = await explorer.footing(eye, BODY);
  expect(footing?.cell).toBe(0);
  expect(footing?.position.map((x) => Number(x.toFixed(3)))).toEqual([0.22, EYE_HEIGHT_M, 3]);
  explorer.close();
});

it("where no ground is below, one stands in the nearest cell", async () => {
  const { explorer, go } = await explore();
  const eye: Vec3 = [-30, 20, 3];
  go(eye);
  const footing = await explorer.footing(eye, BODY);
  expect(footing).toMatchObject({ cell: 0 });
  expect(footing?.position.map((x) => Number(x.toFixed(3)))).toEqual([0.22, EYE_HEIGHT_M, 3]);
  explorer.close();
});

it("a cell is below where a plumb line meets it, also under slanted walls", () => {
  const bounds = { min: [0, 0, 0] as Vec3, max: [10, 10, 10] as Vec3 };
  const slope = Math.SQRT1_2;
  const roof = { bounds, planes: [{ normal: [slope, slope, 0] as Vec3, offset: 10 * slope }] };
  expect(dropTo(roof, [2, 20, 5])).toBeCloseTo(12, 4);
  expect(dropTo(roof, [2, 3, 5])).toBe(0);
  expect(dropTo(roof, [11, 20, 5])).toBe(Number.POSITIVE_INFINITY);
  expect(dropTo(roof, [2, -1, 5])).toBe(Number.POSITIVE_INFINITY);
});
