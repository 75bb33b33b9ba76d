import { expect, it } from "vitest";
import { NOTHING_IN_SIGHT, shares } from "./visible.ts";

it("nothing has no shares", () => {
  const eye = { position: [0, 0, 0], viewAngle_rad: 1, height_px: 720 } as const;
  const nothingHeld = () => ({ held: undefined, taken: 0, failed: new Set<string>() });
  expect(shares(NOTHING_IN_SIGHT, nothingHeld, eye, 1.5)).toBeUndefined();
  expect(shares({ objects: [], count: 4 }, nothingHeld, eye, 1.5)).toEqual({ here: 0, sharp: 0 });
});
