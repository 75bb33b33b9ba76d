import { expect, it } from "vitest";
import { Patience } from "./patience.ts";

it("ends after a few seconds where answers come at once, and after what is unusual where they take long", () => {
  const patience = new Patience(4000);
  expect(patience.quiet_ms).toBe(4000);
  for (let i = 0; i < 20; i += 1) patience.waited(30);
  expect(patience.quiet_ms).toBe(4000);
  for (let i = 0; i < 60; i += 1) patience.waited(9000);
  expect(patience.quiet_ms).toBeGreaterThan(9000);
  expect(patience.quiet_ms).toBeLessThan(12_000);
  for (let i = 0; i < 60; i += 1) patience.waited(30);
  expect(patience.quiet_ms).toBe(4000);
});

it("is shorter where waiting was in vain", () => {
  const patience = new Patience(4000);
  const ends_ms = [1, 2, 3, 4].map(() => {
    patience.wasInVain();
    return patience.quiet_ms;
  });
  expect(ends_ms).toEqual([2000, 1000, 1000, 1000]);
});
