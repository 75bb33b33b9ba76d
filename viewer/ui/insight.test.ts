import { expect, it } from "vitest";
import { InSight } from "./insight.ts";

/** What is said of whoever is in sight at each time, with ten frames a second. */
function said(seconds: number, namesAt: (second: number) => readonly string[]): string[] {
  const heard: string[] = [];
  const insight = new InSight({ say: (topic, text) => void heard.push(`${topic}: ${text}`) });
  for (let tenth = 0; tenth < 10 * seconds; tenth += 1) insight.update(100 * tenth, () => namesAt(tenth / 10));
  return heard;
}

it("is said once it has settled, and not again however long one goes about", () => {
  expect(said(1.5, () => ["Ada"])).toEqual([]);
  expect(said(60, (second) => (second < 1 ? ["Ada"] : ["Ben", "Ada"]))).toEqual([
    "people: 2 people in sight: Ada, Ben",
  ]);
});

it("is not said anew of the same people in another order, nor of who was out of sight for a moment", () => {
  const pillar = (second: number) => (second > 5 && second < 6 ? ["Ada"] : ["Ada", "Ben"]);
  expect(said(20, pillar)).toEqual(["people: 2 people in sight: Ada, Ben"]);
  expect(said(20, (second) => (second < 9 ? ["Ada", "Ben"] : ["Ben", "Ada"]))).toHaveLength(1);
});

it("is never said of a crowd that comes and goes", () => {
  expect(said(30, (second) => Array.from({ length: 3 + (Math.floor(second) % 2) }, () => ""))).toEqual([]);
});

it("is said when the last has gone, and not of nobody to begin with", () => {
  expect(said(20, () => [])).toEqual([]);
  expect(said(20, (second) => (second < 9 ? ["Ada"] : []))).toEqual([
    "people: 1 person in sight: Ada",
    "people: Nobody else in sight",
  ]);
});
