import { expect, it } from "vitest";
import { reasonOf } from "./reason.ts";

it("an error says why, without its name, and anything else is the reason itself", () => {
  expect(reasonOf(new TypeError("it is no number"))).toBe("it is no number");
  expect(reasonOf("it was called off")).toBe("it was called off");
  expect(reasonOf(undefined)).toBe("undefined");
});
