/** Which chunks of an index tree hold these ids, and which are near? */
import { distanceToBounds, type Vec3 } from "../basics/geometry.ts";
import type { Page, PageEntry } from "../documents/documents.ts";

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

/** Ids by the chunk in which they lie; those that lie in none are left out. */
export function byChunk(chunks: readonly PageEntry[], ids: Iterable<number>): Map<PageEntry, number[]> {
  const rising = [...chunks].sort((a, b) => a.first - b.first);
  const below = new Map<PageEntry, number[]>();
  for (const id of ids) {
    // As many chunks begin at the id or before it.
    let [from, to] = [0, rising.length];
    while (from < to) {
      const middle = (from + to) >>> 1;
      if ((rising[middle] as PageEntry).first <= id) from = middle + 1;
      else to = middle;
    }
    const chunk = rising[from - 1];
    if (!chunk || id - chunk.first >= chunk.count) continue;
    const others = below.get(chunk);
    if (others) others.push(id);
    else below.set(chunk, [id]);
  }
  return below;
}

/** All chunks, in the order of their ids; `read` brings a page, or nothing where that cannot be had. */
export async function chunksBelow(
  { entries }: Page,
  read: (entry: PageEntry) => Promise<Page | undefined>,
): Promise<PageEntry[]> {
  const below = entries.map(async (entry) => {
    if (entry.kind === "chunk") return [entry];
    const page = await read(entry);
    return page ? chunksBelow(page, read) : [];
  });
  return (await Promise.all(below)).flat();
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
