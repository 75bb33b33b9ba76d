import { expect, it } from "vitest";
import type { Level } from "../documents/modeldocument.ts";
import { FetchError } from "../fetch/transfer.ts";
import { type Load, ModelFiles, type ModelFilesParts } from "./modelfiles.ts";

const PACK = { url: "/o/a.pack", bytes: 99, from: 0 };
const LEVEL = { level: 0, url: "/o/a.glb", bytes: 9, triangles: 1, textures: [], pack: PACK } as unknown as Level;

it("of a level that comes neither in its silent pack nor alone, it is told why not alone, and it is asked for once each way", async () => {
  const asked: string[] = [];
  const lost = (url: string): Promise<never> => {
    asked.push(url);
    return Promise.reject(new FetchError("status", url, `${url} is not there`));
  };
  const queue = {
    cost_bytes: () => 1,
    untilQuiet: async () => {},
    request: lost,
    // Breaks off only when it has been silent for a while.
    slice: async (_: unknown, pack: string) => {
      await new Promise((resolve) => setImmediate(resolve));
      return lost(pack);
    },
  };
  const tree = { resolve: (url: string) => url };
  const files = new ModelFiles({ queue, tree } as unknown as ModelFilesParts);
  const load = {
    model: { model: 1, levels: [LEVEL] },
    grade: { kind: "level", number: 0 },
    urls: new Set(),
    here: new Set(),
    state: "fetching",
  } as unknown as Load;
  const fetched = files.fetchGrade(load, new Map([[PACK.url, 1]]));
  await expect(fetched).rejects.toMatchObject({ name: "FetchError", url: LEVEL.url });
  expect(asked).toEqual([LEVEL.url, PACK.url]);
});
