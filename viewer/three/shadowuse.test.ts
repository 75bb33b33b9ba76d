import { expect, it } from "vitest";
import { ShadowUse } from "./shadowuse.ts";

const after = (use: ShadowUse, scale: number, pictures: number) =>
  Array.from({ length: pictures }, () => use.after(scale)).at(-1);

it.each([
  [undefined, true, false, true],
  [undefined, true, true, false],
  [undefined, false, false, false],
  ["off", true, false, false],
  ["on", false, true, true],
] as const)("asked for: %s, a graphics card: %s, a phone: %s; shadows: %s", (wish, fast, coarse, drawn) => {
  const use = ShadowUse.on(wish, { fast, coarse });
  expect([use.starts, use.after(1)]).toEqual([drawn, drawn]);
});

it("where moving pictures stay slow although few pixels are drawn, shadows are given up for good", () => {
  const use = ShadowUse.on(undefined, { fast: true, coarse: false });
  expect(after(use, 0.5, 89)).toBe(true);
  expect(use.after(1)).toBe(true);
  expect(after(use, 0.5, 89)).toBe(true);
  expect(use.after(0.5)).toBe(false);
  expect(use.after(1)).toBe(false);
});

it("who has asked for them keeps them", () => {
  expect(after(ShadowUse.on("on", { fast: false, coarse: false }), 0.35, 200)).toBe(true);
});
