import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, it } from "vitest";
import { EYE_HEIGHT_M } from "../core/basics/person.ts";

const BAKE = join(import.meta.dirname, "../../crates/bake/src");

it.each(["records/standing.rs", "import/plan/mod.rs"])("eyes are as high as %s of the bake has them", (file) => {
  const [, height_m] = /const EYE_HEIGHT_M: f\d\d = ([\d.]+);/.exec(readFileSync(join(BAKE, file), "utf8")) ?? [];
  expect(Number(height_m)).toBe(EYE_HEIGHT_M);
});
