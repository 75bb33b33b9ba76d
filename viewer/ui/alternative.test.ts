import { expect, it } from "vitest";
import { describe as words } from "./alternative.ts";

const cube = (name: string, x: number, z: number, size = 1) =>
  ({
    name,
    bounds: { min: [x - size / 2, 0, z - size / 2], max: [x + size / 2, size, z + size / 2] },
  }) as const;
const at = (yaw_deg: number) => ({ position: [0, 0.5, 0], yaw: (yaw_deg * Math.PI) / 180 }) as const;

it("names what is ahead once, the largest in the picture first, and nothing behind or without a name", () => {
  const things = [
    cube("far", 0, -20),
    cube("near", 0.5, -3),
    cube("near", 0, -4),
    cube("behind", 0, 5),
    cube("", 0, -6),
  ];
  expect(words(at(0), things)).toBe("Facing north. Ahead: near, far.");
  expect(words(at(180), things)).toBe("Facing south. Ahead: behind.");
  expect(words(at(90), things)).toBe("Facing west. Nothing is known of what is ahead.");
});

it("says who is in sight, and nothing of people where there is nobody", () => {
  expect(words(at(0), [cube("near", 0, -3)], ["Ben", "Ada"])).toBe(
    "Facing north. Ahead: near. 2 people in sight: Ada, Ben.",
  );
  expect(words(at(0), [], [])).toBe("Facing north. Nothing is known of what is ahead.");
});

it("names six things and no more", () => {
  const things = ["a", "b", "c", "d", "e", "f", "g"].map((name, i) => cube(name, 0, -3 - i));
  expect(words(at(0), things)).toBe("Facing north. Ahead: a, b, c, d, e, f.");
});

it("goes round the compass to the left", () => {
  const facing = [0, 45, 90, 135, 180, 225, 270, -90, -45, 360].map((deg) =>
    words(at(deg), []).split(".")[0]?.slice(7),
  );
  expect(facing.join(" ")).toBe("north north-west west south-west south south-east east east north-east north");
});
