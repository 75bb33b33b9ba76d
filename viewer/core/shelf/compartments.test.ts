import { expect, it, vi } from "vitest";
import { compartments } from "./compartments.ts";
import { Shelf } from "./shelf.ts";

/** What a browser has of `CacheStorage`, in memory. */
function storage(): { caches: CacheStorage; held: Map<string, Response> } {
  const held = new Map<string, Response>();
  const cache = {
    match: async (url: string) => held.get(url)?.clone(),
    put: async (url: string, response: Response) => void held.set(url, response),
    delete: async (url: string) => held.delete(url),
    keys: async () => [...held.keys()].map((url) => ({ url })),
  };
  return { caches: { open: async () => cache } as unknown as CacheStorage, held };
}

const FILE = `https://host/o/${"ab".repeat(32)}.glb`;

async function keepOne(shelf: Shelf | undefined): Promise<void> {
  shelf?.keep(FILE, new ArrayBuffer(12));
  await shelf?.done();
}

it("a page that may start no worker keeps files itself, and finds them and their sizes again", async () => {
  const { caches } = storage();
  await keepOne(await Shelf.open(compartments(caches), 1000, "https://host"));
  const again = await Shelf.open(compartments(caches), 1000, "https://host");
  expect([again?.bytes, (await again?.read(FILE))?.byteLength]).toEqual([12, 12]);
});

it("files are kept by whoever is to do it", async () => {
  const { caches, held } = storage();
  const keep = vi.fn(async () => {});
  await keepOne(await Shelf.open(compartments(caches, keep), 1000, "https://host"));
  expect(keep).toHaveBeenCalledWith(
    expect.objectContaining({ url: expect.stringContaining("abab"), bytes: expect.any(ArrayBuffer) }),
  );
  expect(held.size).toBe(0);
  expect(compartments(undefined)).toBeUndefined();
});
