import { expect, it } from "vitest";
import { isSameWorld } from "./sameworld.ts";

const BASE = "https://page/folder/index.html";

it("links that differ in their place alone, however they are written, lead into the same world", () => {
  const same = (one: string | null, other: string | null) => isSameWorld(one, other, BASE);
  expect(same("../?scene=a", "../?scene=a#p=1,2,3&yaw=90")).toBe(true);
  expect(same("../?scene=a#p=0,0,0", "https://page/?scene=a#")).toBe(true);
  expect(same("../?scene=a", "../?scene=b")).toBe(false);
  expect(same("https://host/?scene=a", "../?scene=a")).toBe(false);
  expect([same(null, null), same(null, ""), same("https://", "https://")]).toEqual([false, false, false]);
});
