import { expect, it, vi } from "vitest";
import { Breaker } from "./breaker.ts";

function broken() {
  const events = { lost: vi.fn(), answered: vi.fn() };
  const breaker = new Breaker(events);
  return { breaker, events };
}

const never = () => false;
const LINE = [{ url: "a" }, { url: "b" }];

it("opens when two are given up and nothing was answered since they began, and closes with an answer", () => {
  const { breaker, events } = broken();
  const { mark } = breaker;
  breaker.answered("b");
  breaker.lost("a", mark);
  expect([breaker.isOpen, events.answered.mock.calls]).toEqual([false, []]);
  breaker.lost("a", breaker.mark);
  breaker.lost("a", breaker.mark);
  expect(breaker.isOpen, "but one file").toBe(false);
  breaker.lost("c", breaker.mark);
  expect(breaker.isOpen).toBe(true);
  expect(events.lost).toHaveBeenCalledTimes(4);
  breaker.answered("b");
  expect([breaker.isOpen, events.answered.mock.calls]).toEqual([false, [[true]]]);
  breaker.answered("a");
  expect(events.answered.mock.calls).toEqual([[true], [false]]);
});

it("stays closed where there are answers, although what comes is broken, and closes with such an answer", () => {
  const { breaker, events } = broken();
  for (const url of ["a", "c", "d"]) breaker.broke(url);
  expect([breaker.isOpen, events.lost.mock.calls.length]).toEqual([false, 3]);
  breaker.lost("a", breaker.mark);
  breaker.lost("c", breaker.mark);
  expect(breaker.isOpen).toBe(true);
  breaker.broke("d");
  expect([breaker.isOpen, events.answered.mock.calls]).toEqual([false, [[true]]]);
});

it("lets one try at a time, each in turn, and another when that is not wanted any more", () => {
  const { breaker } = broken();
  breaker.allow();
  breaker.lost("a", breaker.mark);
  breaker.lost("c", breaker.mark);
  expect(breaker.choose(LINE, never)).toBeUndefined();
  breaker.allow();
  expect([breaker.choose(LINE, never)?.url, breaker.choose(LINE, never)]).toEqual(["b", undefined]);
  breaker.cancelled("a");
  expect(breaker.choose(LINE, never)).toBeUndefined();
  breaker.cancelled("b");
  expect(breaker.choose(LINE, never)?.url).toBe("b");
  breaker.lost("b", breaker.mark);
  breaker.allow();
  expect(breaker.choose(LINE, never)?.url).toBe("a");
});

it("lets what is pressing try without being let, once", () => {
  const { breaker } = broken();
  breaker.lost("a", breaker.mark);
  breaker.lost("d", breaker.mark);
  const pressing = ({ url }: { url: string }) => url !== "c";
  expect(breaker.choose([...LINE, { url: "c" }], pressing)?.url).toBe("b");
  breaker.lost("b", breaker.mark);
  expect(breaker.choose([...LINE, { url: "c" }], pressing)).toBeUndefined();
});
