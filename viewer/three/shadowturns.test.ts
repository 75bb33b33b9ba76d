import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { Vec3 } from "../core/basics/geometry.ts";
import { TILE_PX } from "./shading.ts";
import { ShadowTurns, sunFromWorld } from "./shadowturns.ts";

const SUN = new Vector3(0.5, 1, 0.3).normalize();
const TOWN = { across_m: 900, clearance_m: 2 };

/** Of one who has drawn at the origin at 0 ms. */
function drawn(): ShadowTurns {
  const turns = new ShadowTurns(SUN);
  turns.due(0, [0, 0, 0], TOWN);
  return turns;
}

describe("the shadow map is drawn", () => {
  it("to begin with, and not again while one stands still", () => {
    const turns = new ShadowTurns(SUN);
    expect(turns.due(0, [0, 1.6, 0], TOWN)).toMatchObject({ reach_m: 192 });
    expect(turns.due(60_000, [0, 1.6, 0], TOWN)).toBeUndefined();
  });

  it("when the eye has gone some metres, the fewer the smaller a world is", () => {
    expect(drawn().due(1000, [0, 0, 2.3], TOWN)).toBeUndefined();
    expect(drawn().due(1000, [0, 0, 2.5], TOWN)).toBeDefined();
    const inRoom = new ShadowTurns(SUN);
    inRoom.due(0, [0, 0, 0], { across_m: 8, clearance_m: 1 });
    expect(inRoom.due(1000, [0, 0, 0.25], { across_m: 8, clearance_m: 1 })).toMatchObject({ reach_m: 12 });
  });

  it("when something has changed, once", () => {
    const turns = drawn();
    turns.changed();
    expect(turns.due(1000, [0, 0, 0], TOWN)).toBeDefined();
    expect(turns.due(2000, [0, 0, 0], TOWN)).toBeUndefined();
  });

  it("a few times a second at most, and what came too early is not forgotten", () => {
    const turns = drawn();
    turns.changed();
    expect(turns.due(300, [0, 0, 90], TOWN)).toBeUndefined();
    expect(turns.due(400, [0, 0, 90], TOWN)).toBeDefined();
  });

  it("further where all is far away, as for who flies high up", () => {
    expect(drawn().due(1000, [0, 0, 0], { across_m: 900, clearance_m: 100 })).toMatchObject({ reach_m: 384 });
  });
});

it.each<Vec3>([
  [0, 0, 0],
  [3, 1.6, -2],
  [-170.3, 40, 1234.5],
])("texels stay where they are in the world when it is drawn from %s", (...eye) => {
  const extent = new ShadowTurns(SUN).due(0, eye, TOWN);
  const texel_m = (2 * 192) / TILE_PX;
  const centre = extent?.centre ?? new Vector3();
  const inTexels = centre.clone().applyMatrix4(sunFromWorld(SUN)).divideScalar(texel_m).toArray();
  for (const along of inTexels) expect(along).toBeCloseTo(Math.round(along), 6);
  expect(centre.distanceTo(new Vector3(...eye))).toBeLessThan(texel_m);
});

it("the sun sees what is nearer to it further up its own axis", () => {
  const [, , towards] = SUN.clone().multiplyScalar(5).applyMatrix4(sunFromWorld(SUN)).toArray();
  expect(towards).toBeCloseTo(5);
});
