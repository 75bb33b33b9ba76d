import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";

/** Of text on its ground, as WCAG 2 asks of the page. */
const LEAST_CONTRAST = 4.5;
/** What shines through a panel at worst, for the light text that stands on it. */
const WHITE: Colour = { rgb: [255, 255, 255], share: 1 };

interface Colour {
  readonly rgb: readonly number[];
  readonly share: number;
}

function parse(text: string): Colour {
  const digits = text.match(/^#([\da-f]{6})$/i)?.[1];
  if (digits) return { rgb: [0, 2, 4].map((at) => Number.parseInt(digits.slice(at, at + 2), 16)), share: 1 };
  const [red, green, blue, percent] = (text.match(/[\d.]+/g) ?? []).map(Number);
  if (red === undefined || green === undefined || blue === undefined) throw new Error(`${text} is no colour`);
  return { rgb: [red, green, blue], share: (percent ?? 100) / 100 };
}

const over = (top: Colour, ground: Colour): Colour => ({
  rgb: top.rgb.map((value, i) => top.share * value + (1 - top.share) * (ground.rgb[i] ?? 0)),
  share: 1,
});

/** Relative luminance by WCAG 2. */
function luminance({ rgb }: Colour): number {
  const [r = 0, g = 0, b = 0] = rgb.map((value) => {
    const share = value / 255;
    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

function contrast(text: Colour, ground: Colour): number {
  const [light = 0, dark = 0] = [luminance(text), luminance(ground)].sort((a, b) => b - a);
  return (light + 0.05) / (dark + 0.05);
}

const read = (path: string) => readFileSync(join(import.meta.dirname, path), "utf8");
const style = read("style.css");

function variable(name: string): Colour {
  const value = style.match(new RegExp(`--${name}: ([^;]+);`))?.[1];
  if (!value) throw new Error(`the page has no colour called ${name}`);
  return parse(value);
}

it("black on white has the contrast that WCAG says", () => {
  expect(contrast(parse("#000000"), WHITE)).toBeCloseTo(21, 6);
  expect(contrast(parse("#767676"), WHITE)).toBeCloseTo(4.54, 2);
});

describe("on a panel in front of a white wall", () => {
  const card = over(variable("card"), WHITE);

  it.each(["ink", "soft", "gold"])("%s can be read", (name) => {
    expect(contrast(variable(name), card)).toBeGreaterThanOrEqual(LEAST_CONTRAST);
  });

  it.each([8, 16])("a control that is %d %% lighter can be read", (percent) => {
    const control = over({ ...WHITE, share: percent / 100 }, card);
    expect(contrast(variable("ink"), control)).toBeGreaterThanOrEqual(LEAST_CONTRAST);
  });
});

it("every panel that has a ground of its own is no clearer than the others", () => {
  const grounds = ["style.css", "panels.css", "inspector/inspector.css", "../embed/style.ts"].flatMap((path) => [
    ...read(path).matchAll(/rgb\(17 21 27 \/ (\d+)%\)/g),
  ]);
  expect(grounds.length).toBeGreaterThanOrEqual(3);
  for (const [, percent] of grounds) expect(Number(percent)).toBeGreaterThanOrEqual(88);
});
