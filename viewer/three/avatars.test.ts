import { Color } from "three";
import { expect, it } from "vitest";
import { rateColour } from "./avatars.ts";

it("discs under people are drawn green for ten updates a second, yellow between, and red for one and fewer", () => {
  const drawn = [100, 316, 1000, 9000].map((period_ms) => new Color(rateColour(period_ms)).getHexString());
  expect(drawn).toEqual(["42d742", "d7d742", "d74242", "d74242"]);
});
