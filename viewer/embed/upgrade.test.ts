import { expect, it } from "vitest";
import { takeEarly } from "./upgrade.ts";

class Link {
  heard: string[] = [];

  get src(): string {
    return this.heard.at(-1) ?? "";
  }

  set src(src: string) {
    this.heard.push(src);
  }
}

it("what was set before the class was known reaches the class, and so does what is set later", () => {
  const element = new Link();
  Object.defineProperty(element, "src", { value: "early", configurable: true, enumerable: true, writable: true });
  expect(element.heard).toEqual([]);
  takeEarly(element, "src");
  element.src = "late";
  expect(element.heard).toEqual(["early", "late"]);
});

it("what was not set is left alone", () => {
  const element = new Link();
  takeEarly(element, "src");
  expect(element.heard).toEqual([]);
});
