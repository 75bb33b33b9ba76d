import { expect, it } from "vitest";
import type { Vec3 } from "../basics/geometry.ts";
import { astray, isFar } from "./astray.ts";

const WORLD = { min: [0, 0, 0] as Vec3, max: [12, 3, 6] as Vec3 };
const ROOM = { bounds: { min: [0, 0, 0] as Vec3, max: [5.9, 3, 6] as Vec3 }, planes: [] };

const at = (x: number, mode: "fly" | "walk" = "walk") => ({ position: [x, 1.6, 3] as Vec3, yaw: 0, pitch: 0, mode });

it("who walks goes astray outside of the world and inside of walls, but not by what links are rounded", () => {
  expect(astray(WORLD, ROOM, at(3), 1)).toBeUndefined();
  expect(astray(WORLD, ROOM, at(5.9004), 1)).toBeUndefined();
  expect(astray(WORLD, ROOM, at(6), 1)).toBe("walled");
  expect(astray(WORLD, ROOM, at(-20), 1)).toBe("outside");
  // To somebody small, a little is much.
  expect(astray(WORLD, ROOM, at(5.915), 0.1)).toBe("walled");
});

it("who flies may be anywhere from where something of the world is to be seen", () => {
  expect(astray(WORLD, ROOM, at(6, "fly"), 1)).toBeUndefined();
  expect(astray(WORLD, ROOM, at(-40, "fly"), 1)).toBeUndefined();
  expect(astray(WORLD, ROOM, at(1e9, "fly"), 1)).toBe("outside");
  expect([isFar(WORLD, at(1e9)), isFar(WORLD, at(-40))]).toEqual([true, false]);
});
