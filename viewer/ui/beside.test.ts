import { expect, it } from "vitest";
import { coveredBy } from "./beside.ts";

it.each([
  ["at the right", { left: 628, top: 12 }, { width: 1000, height: 640 }, { right_px: 372, bottom_px: 0 }],
  ["along the bottom of a phone", { left: 0, top: 395 }, { width: 400, height: 760 }, { right_px: 0, bottom_px: 365 }],
  ["that covers all", { left: -5, top: 0 }, { width: 400, height: 760 }, { right_px: 400, bottom_px: 0 }],
  ["beside the picture", { left: 900, top: 0 }, { width: 800, height: 600 }, { right_px: 0, bottom_px: 0 }],
])("a panel %s covers so much", (_, panel, picture, covered) => {
  expect(coveredBy(panel, picture)).toEqual(covered);
});
