import { expect, test } from "vitest";
import { Sky } from "./sky.ts";

/** How much of what is so far away is haze, as three.js mixes it. */
function share(sky: Sky, distance_m: number): number {
  return 1 - Math.exp(-((sky.haze.density * distance_m) ** 2));
}

test("rooms have no haze, and a large world has some of it at its far end", () => {
  const sky = new Sky();
  for (const diagonal_m of [0.1, 60, 700, 30_000]) {
    sky.fit(diagonal_m, 0);
    expect(share(sky, 100)).toBeLessThan(0.01);
    expect(share(sky, diagonal_m)).toBeLessThan(0.25);
  }
  expect(share(sky, 30_000)).toBeGreaterThan(0.2);
});

test("the ground lies as far below as the eye is above the world's, but never so near that its horizon is an edge", () => {
  const sky = new Sky();
  sky.fit(1000, 50);
  const height = () => sky.mesh.material.uniforms.height?.value as number;
  sky.seeFrom(1050);
  expect(height()).toBeCloseTo(1000 * sky.haze.density);
  sky.seeFrom(51.65);
  const standing = height();
  expect(standing).toBeGreaterThan(1.65 * sky.haze.density);
  sky.seeFrom(-500);
  expect(height()).toBe(standing);
});
