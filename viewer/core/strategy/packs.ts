/**
 * Which coarsest levels come together? A pack holds those that the same cells see, one GLB after the other; who wants most
 * of it fetches all of it with one request, and draws each as soon as it has come.
 */
import type { Level, PackRef } from "../documents/modeldocument.ts";
import type { CostOf } from "./file.ts";

/** A pack is fetched whole when at least this share of its bytes is wanted. */
const WORTH_A_PACK = 0.5;

/**
 * The packs that are worth fetching, by URL, for who wants these levels, and how many of them each brings; those that cost
 * nothing always are. Levels that cost nothing alone need none.
 */
export function packsWorth(levels: Iterable<Level>, costOf: CostOf): Map<string, number> {
  const packs = new Map<string, { pack: PackRef; files: Map<number, number> }>();
  for (const level of levels) {
    const { pack, bytes } = level;
    if (!pack || costOf(level) === 0) continue;
    const known = packs.get(pack.url) ?? { pack, files: new Map<number, number>() };
    packs.set(pack.url, known);
    known.files.set(pack.from, bytes);
  }
  const worth = [...packs.values()].filter(({ pack, files }) => {
    const wanted_bytes = [...files.values()].reduce((sum, bytes) => sum + bytes, 0);
    return wanted_bytes >= WORTH_A_PACK * pack.bytes || costOf(pack) === 0;
  });
  return new Map(worth.map(({ pack, files }) => [pack.url, files.size]));
}
