/** Which chunks of an index tree hold these ids, and which are near? */
import type { Page, PageEntry } from "./documents.ts";
import { distanceToBounds, type Vec3 } from "./geometry.ts";

/** A chunk, and those of the ids that lie below it. */
export interface Holder {
  readonly chunk: PageEntry;
  /** In the order in which they were asked for; never empty. */
  readonly ids: readonly number[];
}

/** The entry below which an id lies. */
export function entryOf(page: Page, id: number): PageEntry | undefined {
  return page.entries.find((entry) => entry.first <= id && id - entry.first < entry.count);
}

/**
 * The chunks that hold them; ids that lie nowhere are left out. `read` brings a page for the sake of the first of some ids, or nothing where
 * that cannot be had.
 */
export async function holdersOf(
  root: Page,
  ids: readonly number[],
  read: (entry: PageEntry, first: number) => Promise<Page | undefined>,
): Promise<Holder[]> {
  const below = new Map<PageEntry, [number, ...number[]]>();
  for (const id of ids) {
    const entry = entryOf(root, id);
    const others = entry && below.get(entry);
    if (others) others.push(id);
    else if (entry) below.set(entry, [id]);
  }
  const holders = [...below].map(async ([entry, ids]) => {
    if (entry.kind === "chunk") return [{ chunk: entry, ids }];
    const page = await read(entry, ids[0]);
    return page ? holdersOf(page, ids, read) : [];
  });
  return (await Promise.all(holders)).flat();
}

/** The chunks from the nearest to a point to the furthest; `read` brings a page, or nothing where that cannot be had. */
export async function* nearestChunks(
  root: Page,
  point: Vec3,
  read: (entry: PageEntry) => Promise<Page | undefined>,
): AsyncGenerator<PageEntry> {
  const open = [...root.entries];
  for (;;) {
    open.sort((a, b) => distanceToBounds(b.bounds, point) - distanceToBounds(a.bounds, point));
    const next = open.pop();
    if (!next) return;
    if (next.kind === "chunk") yield next;
    else open.push(...((await read(next))?.entries ?? []));
  }
}
