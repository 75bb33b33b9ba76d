import { expect, it } from "vitest";
import type { Grade } from "../strategy/grade.ts";
import { PlainModels } from "./plainmodels.ts";

const grade = (number: number): Grade => ({ kind: "level", number, triangles: 1, geometricError: number });
const plain = (bytes: number, ...lacks: string[]) => ({ glb: new ArrayBuffer(bytes), lacks });

it("a mesh is kept until it is drawn with all its textures, or by another grade", () => {
  const models = new PlainModels();
  models.drawn(7, grade(2), plain(10, "/o/a.png"));
  models.drawn(7, grade(1), plain(100, "/o/a.png", "/o/b.png"));
  models.drawn(8, grade(1), plain(1000));
  expect([models.bytes(7), models.bytes(8)]).toEqual([110, 0]);
  expect(models.of(7, grade(1))?.lacks).toEqual(["/o/a.png", "/o/b.png"]);
  models.drawn(7, grade(1), plain(100, "/o/b.png"));
  expect(models.of(7, grade(1))?.lacks).toEqual(["/o/b.png"]);
  models.keepOnly(7, [grade(2), grade(0)]);
  expect([models.of(7, grade(1)), models.bytes(7)]).toEqual([undefined, 10]);
  models.drawn(7, grade(2), plain(10));
  expect(models.bytes(7)).toBe(0);
});
