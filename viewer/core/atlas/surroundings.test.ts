import { afterEach, beforeEach, expect, it, vi } from "vitest";
import type { ObjectDirectory } from "./objects.ts";
import type { PublishedScene } from "./published.ts";
import { Surroundings } from "./surroundings.ts";

const BOUNDS = { min: [0, 0, 0], max: [9, 9, 9] };
const PAGE = { kind: "page", url: "/o/a.json", bytes: 9, first: 0, count: 1, bounds: BOUNDS };
const unhandled = vi.fn();

beforeEach(() => {
  unhandled.mockClear();
  process.on("unhandledRejection", unhandled);
});
afterEach(() => void process.off("unhandledRejection", unhandled));

/** What is around in a world of one page, which falls silent and comes a while after that. */
async function look(how?: "meanwhile") {
  const scene = {
    manifest: { bounds: BOUNDS, objects: { entries: [PAGE] } },
    tree: { resolve: (url: string) => url },
    queue: { untilQuiet: async () => {}, isSilent: true },
    page: async () => {
      for (const _ of [1, 2, 3]) await new Promise((resolve) => setImmediate(resolve));
      return { entries: [] };
    },
  } as unknown as PublishedScene;
  const directory = { whole: () => undefined, knownBelow: () => [] } as unknown as ObjectDirectory;
  const problem = vi.fn();
  const around = await new Surroundings(scene, directory, problem).look([1, 1, 1], () => {}, how);
  expect(problem).not.toHaveBeenCalled();
  return around;
}

it("a silent page is waited for, and its silence is no error of anybody", async () => {
  expect(await look()).toEqual({ objects: [], isAll: true });
  expect(unhandled).not.toHaveBeenCalled();
});

it("a silent page is done without meanwhile, and may come yet", async () => {
  expect(await look("meanwhile")).toEqual({ objects: [], isAll: false });
  expect(unhandled).not.toHaveBeenCalled();
});
