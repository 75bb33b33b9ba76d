import { afterEach, expect, it, vi } from "vitest";
import { Throttle } from "../../core/fetch/throttle.ts";
import { chooseLine, keepLine } from "./line.ts";

afterEach(() => vi.unstubAllGlobals());

/** What a tab keeps, over all pages that are loaded in it. */
function tab() {
  const kept = new Map<string, string>();
  vi.stubGlobal("sessionStorage", {
    getItem: (name: string) => kept.get(name) ?? null,
    setItem: (name: string, value: string) => kept.set(name, value),
  });
}

/** A page that has just been loaded: what it knows of a line, and for how long it waits before it has its first answer. */
async function page() {
  const waits_ms: number[] = [];
  const clock = {
    now_ms: () => 0,
    pause: async (ms: number) => {
      waits_ms.push(ms);
    },
  };
  const throttle = new Throttle(async () => new Response(null), clock);
  keepLine(throttle);
  await throttle.fetch("https://host/v1/scenes/index.json", {});
  return { throttle, waits_ms };
}

it("a line that was chosen slows down the next page from its first request, until none is chosen", async () => {
  tab();
  const first = await page();
  expect(first.waits_ms).toEqual([]);
  chooseLine(first.throttle, "56k");
  const second = await page();
  expect(second.throttle.line?.name).toBe("56k");
  expect(second.waits_ms).toEqual([120]);
  chooseLine(second.throttle, "");
  expect((await page()).waits_ms).toEqual([]);
});

it("a page that may keep nothing is slowed down all the same", async () => {
  vi.stubGlobal("sessionStorage", undefined);
  const { throttle } = await page();
  chooseLine(throttle, "3G");
  expect(throttle.line?.name).toBe("3G");
});

it("what is no line any more slows down nothing", async () => {
  tab();
  sessionStorage.setItem("belvedere.line", "9600");
  expect((await page()).throttle.line).toBeUndefined();
});
