import { expect, it } from "vitest";
import type { LoggedRequest } from "../../core/fetch/requestlog.ts";
import { spanOf } from "./requests.ts";

const asked = (asked_ms: number, ended_ms?: number) => ({ asked_ms, ended_ms }) as LoggedRequest;

it("bars span from what was asked for first to now, or to the last end where all have ended", () => {
  expect(spanOf([asked(200, 900), asked(500)], 7000)).toEqual({ from_ms: 200, to_ms: 7000 });
  expect(spanOf([asked(200, 900), asked(500, 4000)], 7000)).toEqual({ from_ms: 200, to_ms: 4000 });
});

it("bars of what has only begun span a second all the same, and those of nothing too", () => {
  expect(spanOf([asked(6900)], 7000)).toEqual({ from_ms: 6000, to_ms: 7000 });
  expect(spanOf([asked(200, 210)], 7000)).toEqual({ from_ms: 200, to_ms: 1200 });
  expect(spanOf([], 7000)).toEqual({ from_ms: 6000, to_ms: 7000 });
});
