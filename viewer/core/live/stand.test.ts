import { describe, expect, it } from "vitest";
import { standIn } from "./stand.ts";

const bounds = { min: [0, 0, 0], max: [3, 0, 4] } as const;

describe("standIn", () => {
  it("leaves who is in the scene or near it", () => {
    expect(standIn(bounds, [1, 1, 1])).toEqual([1, 1, 1]);
    expect(standIn(bounds, [-4.9, 4.9, 8.9])).toEqual([-4.9, 4.9, 8.9]);
  });

  it("keeps who is further away than the scene is large at that edge", () => {
    const [x, y, z] = standIn(bounds, [100, 100, -100]);
    expect(x).toBeLessThanOrEqual(8);
    expect(x).toBeGreaterThan(7.9);
    expect(y).toBeLessThanOrEqual(5);
    expect(z).toBeGreaterThanOrEqual(-5);
    expect(z).toBeLessThan(-4.9);
  });
});
