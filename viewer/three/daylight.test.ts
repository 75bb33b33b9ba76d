import { Vector3 } from "three";
import { expect, test } from "vitest";
import { DARKNESS, FILL, type Lamp, SKYLIGHT, SUN } from "./daylight.ts";
import { mirrored } from "./skylight.ts";

/** Paving and the stripes in it: the darker has so much of the light of the other. */
const OTHER_STONE = 0.78;

/** How much green light falls on what faces so, as three.js counts it: from all around comes π times what a matt surface gathers. */
function falling(normal: Vector3, shadow: number): number {
  const from = ({ towards, colour, intensity }: Lamp) => intensity * colour.g * Math.max(0, normal.dot(towards));
  return (1 - shadow) * from(SUN) + from(FILL) + Math.PI * SKYLIGHT * mirrored(1, normal.y)[1];
}

test("a shadow on level ground is much darker than one stone beside another, and no hole", () => {
  const up = new Vector3(0, 1, 0);
  const left = falling(up, DARKNESS) / falling(up, 0);
  expect(left).toBeLessThan(OTHER_STONE ** 2);
  expect(left).toBeGreaterThan(0.4);
});
