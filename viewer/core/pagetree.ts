/** Which chunks of an index tree hold these ids? */
import type { Page, PageEntry } from "./documents.ts";

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

/** The chunks that hold them; ids that lie nowhere are left out. `read` brings a page for the sake of the first of some ids. */
export async function holdersOf(
  root: Page,
  ids: readonly number[],
  read: (entry: PageEntry, first: number) => Promise<Page>,
): Promise<Holder[]> {
  const below = new Map<PageEntry, [number, ...number[]]>();
  for (const id of ids) {
    const entry = entryOf(root, id);
    const others = entry && below.get(entry);
    if (others) others.push(id);
    else if (entry) below.set(entry, [id]);
  }
  const holders = [...below].map(async ([entry, ids]) => {
    return entry.kind === "chunk" ? [{ chunk: entry, ids }] : holdersOf(await read(entry, ids[0]), ids, read);
  });
  return (await Promise.all(holders)).flat();
}
