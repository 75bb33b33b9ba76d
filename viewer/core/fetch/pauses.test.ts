import { expect, it } from "vitest";
import { Pauses, retryAfter_ms } from "./pauses.ts";

const LENGTHS = { first_ms: 5000, longest_ms: 60_000 };
const asking = (text: string) => ({ headers: new Headers({ "Retry-After": text }) });

it("pauses grow up to the longest, and begin anew when all is well or nothing has failed for long", () => {
  const pauses = new Pauses(LENGTHS, () => 0.5);
  let now_ms = 0;
  const next_s = () => {
    const until_ms = pauses.after(now_ms);
    const pause_s = (until_ms - now_ms) / 1000;
    now_ms = until_ms;
    return pause_s;
  };
  expect([1, 2, 3, 4, 5, 6].map(next_s)).toEqual([5, 10, 20, 40, 60, 60]);
  now_ms += 59_000;
  expect(next_s()).toBe(60);
  now_ms += 61_000;
  expect([next_s(), next_s()]).toEqual([5, 10]);
  pauses.over();
  expect(next_s()).toBe(5);
});

it("pauses differ from visitor to visitor, and are no shorter than the server asks for", () => {
  const first = (random: number, answer?: { headers: Headers }) => new Pauses(LENGTHS, () => random).after(0, answer);
  expect([first(0), first(1)]).toEqual([4000, 6000]);
  expect([first(0, asking("60")), first(1, asking("60"))]).toEqual([60_000, 72_000]);
  expect(first(0.5, asking("1"))).toBe(5000);
});

it("what a server asks for is read in seconds or as a date, and is not waited for longer than an hour", () => {
  const read = (text: string) => retryAfter_ms(asking(text).headers, Date.parse("Fri, 02 Jan 2026 00:00:00 GMT"));
  expect(read("7")).toBe(7000);
  expect(read("Fri, 02 Jan 2026 00:00:30 GMT")).toBe(30_000);
  expect(["Thu, 01 Jan 2026 00:00:00 GMT", "soon", ""].map(read)).toEqual([0, 0, 0]);
  expect(read("99999999")).toBe(3_600_000);
  expect(retryAfter_ms(new Headers())).toBe(0);
});
