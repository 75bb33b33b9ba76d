import { expect, it } from "vitest";
import { QualityHistory } from "./quality.ts";

it("samples no more often than it should and forgets what is old", () => {
  const history = new QualityHistory(100, 1000);
  let measured = 0;
  for (let t_ms = 0; t_ms <= 2000; t_ms += 50) {
    history.sample(t_ms, () => {
      measured += 1;
      return { here: 1, sharp: 0.5 };
    });
  }
  expect(measured).toBe(21);
  expect(history.samples.map(({ t_ms }) => t_ms)).toEqual([
    1000, 1100, 1200, 1300, 1400, 1500, 1600, 1700, 1800, 1900, 2000,
  ]);
});

it("says so while it is not known what is visible", () => {
  const history = new QualityHistory(100, 1000);
  history.sample(0, () => undefined);
  expect(history.samples).toEqual([{ t_ms: 0, here: undefined, sharp: undefined }]);
});
