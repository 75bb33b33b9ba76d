import { describe, expect, it } from "vitest";
import { EYE, placedAhead } from "../../test/placed.ts";
import { costAlone_bytes } from "./file.ts";
import { type Grade, goalOf } from "./grade.ts";
import { plan, type Stock, shrink } from "./plan.ts";
import { errorThatDoes, screenError_px } from "./sight.ts";

const TARGET_PX = 1.5;
const ERRORS = [0, 0.01, 0.1];
const level = (number: number, geometricError = ERRORS[number] ?? 0): Grade => ({
  kind: "level",
  number,
  triangles: 1,
  geometricError,
});

function holding(held: Record<number, number>, failed: Record<number, number[]> = {}): Stock {
  return {
    of: (model) => ({
      held: held[model] === undefined ? undefined : level(held[model]),
      taken: 0,
      failed: new Set((failed[model] ?? []).map((number) => `level ${number}`)),
    }),
    costOf: costAlone_bytes,
  };
}
const summary = (wants: ReturnType<typeof plan>) => wants.map((want) => [want.object.model.model, want.grade.number]);

describe("the plan", () => {
  const near = placedAhead(0, 0, 1, [0, 0.01, 0.1]);
  const far = placedAhead(1, 1, 200, [0, 0.01, 0.1]);
  const middle = placedAhead(2, 2, 20, [0, 0.01, 0.1]);

  it("holds coarsest levels only, in the record's order, while one is missing", () => {
    expect(summary(plan([far, near, middle], holding({ 0: 2 }), EYE, TARGET_PX))).toEqual([
      [1, 2],
      [2, 2],
    ]);
  });

  it("then refines by screen error, the worst first, and leaves alone what is good enough", () => {
    expect(summary(plan([far, middle, near], holding({ 0: 2, 1: 2, 2: 2 }), EYE, TARGET_PX))).toEqual([
      [0, 0],
      [2, 1],
    ]);
  });

  it("fetches a shared model once, as fine as its nearest object needs", () => {
    const twin = placedAhead(3, 1, 1, [0, 0.01, 0.1]);
    expect(summary(plan([far, twin], holding({}), EYE, TARGET_PX))).toEqual([[1, 2]]);
    expect(summary(plan([far, twin], holding({ 1: 2 }), EYE, TARGET_PX))).toEqual([[1, 0]]);
  });

  it("goes on to the next coarsest level when one cannot be had, and never asks for a failed one", () => {
    expect(summary(plan([near], holding({}, { 0: [2] }), EYE, TARGET_PX))).toEqual([[0, 1]]);
    expect(summary(plan([near], holding({}, { 0: [0, 1, 2] }), EYE, TARGET_PX))).toEqual([]);
    expect(summary(plan([near], holding({ 0: 2 }, { 0: [0] }), EYE, TARGET_PX))).toEqual([]);
  });

  it("asks for the textures of what is drawn plain, before what is only coarse, unless finer ones come anyway", () => {
    const plain = (...models: number[]): Stock => {
      const { of, costOf } = holding({ 0: 0, 1: 2, 2: 2 });
      return { of: (model) => ({ ...of(model), isPlain: models.includes(model) }), costOf };
    };
    const wants = plan([near, far, middle], plain(0, 2), EYE, TARGET_PX);
    expect(wants.map(({ object, grade, cause }) => [object.model.model, grade.number, cause.kind])).toEqual([
      [0, 0, "plain"],
      [2, 1, "finer"],
    ]);
    expect(summary(plan([near, far, middle], plain(1), EYE, TARGET_PX))).toEqual([
      [1, 2],
      [2, 1],
    ]);
  });

  it("does not ask again for what is drawn plain and could not be drawn anew", () => {
    const causes = (failed: Record<number, number[]>) => {
      const { of, costOf } = holding({ 0: 0 }, failed);
      const stock: Stock = { of: (model) => ({ ...of(model), isPlain: true }), costOf };
      return plan([near], stock, EYE, TARGET_PX).map(({ cause }) => cause.kind);
    };
    expect(causes({})).toContain("plain");
    expect(causes({ 0: [0] })).not.toContain("plain");
  });

  it("when memory is short, draws what takes most of it more coarsely", () => {
    const held = (model: number) =>
      [
        { grade: level(0), bytes: 70 },
        { grade: level(2), bytes: 90 },
        { grade: level(1), bytes: 80 },
      ][model];
    const want = shrink([near, far, middle], held);
    expect([want?.object.model.model, want?.grade.number]).toEqual([2, 2]);
    expect(shrink([far], held)).toBeUndefined();
  });
});

it("one millimetre at one metre covers about a pixel of a 1080 pixel picture under 60°", () => {
  expect(screenError_px(0.001, 1, EYE)).toBeCloseTo(0.935, 2);
  expect(screenError_px(0, 0, EYE)).toBe(0);
});

it("an eye inside an object's box wants the finest level", () => {
  const around = placedAhead(0, 0, -0.5, [0.001, 0.1]);
  const most_error = errorThatDoes(around, EYE, 1.5);
  const nothing = { held: undefined, taken: 0, failed: new Set<string>() };
  expect(goalOf(around.model, most_error, nothing, costAlone_bytes)).toMatchObject({ kind: "level", number: 0 });
});
