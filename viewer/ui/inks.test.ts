import { expect, it } from "vitest";
import { systemInks } from "./inks.ts";

it("what a canvas draws in forced colours is made of the system's alone, and one's own place never of the ground's", () => {
  const colours: Readonly<Record<string, string>> = {
    Canvas: "rgb(255, 255, 255)",
    CanvasText: "rgb(0, 0, 0)",
    Highlight: "rgb(55, 55, 117)",
    LinkText: "rgb(0, 0, 159)",
  };
  const inks = systemInks((keyword) => colours[keyword] ?? expect.fail(`${keyword} is no colour of the system's`));
  for (const [name, ink] of Object.entries(inks)) {
    const made = ink.match(/rgb\([^)]+\)/g) ?? [];
    expect(made.length, name).toBeGreaterThan(0);
    for (const one of made) expect(Object.values(colours), name).toContain(one);
  }
  expect([inks.mark, inks.rim]).toEqual([colours.CanvasText, colours.Canvas]);
  expect(inks.here).toBe(colours.Highlight);
  // What lies on a chart, or on the map, is told apart.
  expect(new Set([inks.here, inks.seen, inks.storey, inks.below]).size).toBe(4);
  expect(inks.chartHere).not.toBe(inks.chartSharp);
});
