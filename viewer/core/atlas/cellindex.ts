/**
 * In which cell is a point? Adjacency first: a walker mostly stays or steps next door, which needs no request. Otherwise
 * a best-first search down the page tree, which reads as few pages as possible and finds the nearest cell when no cell
 * holds the point. Where cells touch, the search takes the lowest id, so that every client agrees on faces and corners.
 * A page or chunk that cannot be had is done without, until one asks for it once more: what is known has to do.
 */
import { type Convex, distanceToCell, dropTo } from "../basics/convex.ts";
import type { Vec3 } from "../basics/geometry.ts";
import type { CellEntry, Page, PageEntry } from "../documents/documents.ts";
import type { Retried } from "../fetch/losses.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { walkTo } from "./cellwalk.ts";
import { LostPages } from "./lostpages.ts";
import { entryOf, nearestChunks } from "./pagetree.ts";
import type { PublishedScene } from "./published.ts";

export interface Located {
  readonly entry: CellEntry;
  /** Zero when the cell holds the point. */
  readonly distance_m: number;
}

/** The search itself; it says what to read next and is given it, and so does no I/O. */
export class CellSearch {
  /** Sorted by distance, then by first id. */
  private readonly open: { distance_m: number; entry: PageEntry }[] = [];
  private best: Located | undefined;

  /** `measure` says how far a cell, or a box of cells, is from the point; what is infinitely far does not count. */
  constructor(
    root: Page,
    private readonly point: Vec3,
    private readonly measure: (cell: Convex, point: Vec3) => number = distanceToCell,
  ) {
    this.add(root);
  }

  /** What to read next, or `undefined` when the search is over. */
  wants(): PageEntry | undefined {
    const next = this.open[0];
    if (!next) return undefined;
    if (this.best) {
      const nearer = this.best.distance_m < next.distance_m;
      // At equal distance a lower id may still wait in an earlier subtree.
      const tied = this.best.distance_m === next.distance_m && this.best.entry.cell < next.entry.first;
      if (nearer || tied) return undefined;
    }
    return next.entry;
  }

  givePage(page: Page): void {
    this.open.shift();
    this.add(page);
  }

  giveChunk(cells: Iterable<CellEntry>): void {
    this.open.shift();
    this.consider(cells);
  }

  /** What was to be read next cannot be had. */
  skip(): void {
    this.open.shift();
  }

  /** Whoever of these is nearer is the answer. */
  consider(cells: Iterable<CellEntry>): void {
    for (const entry of cells) {
      const distance_m = this.measure(entry, this.point);
      if (distance_m === Number.POSITIVE_INFINITY) continue;
      const best = this.best;
      const better =
        !best || distance_m < best.distance_m || (distance_m === best.distance_m && entry.cell < best.entry.cell);
      if (better) this.best = { entry, distance_m };
    }
  }

  /** The answer; `undefined` only when no cell was given. */
  finish(): Located | undefined {
    return this.best;
  }

  private add(page: Page): void {
    for (const entry of page.entries) {
      const distance_m = this.measure({ bounds: entry.bounds, planes: [] }, this.point);
      if (distance_m < Number.POSITIVE_INFINITY) this.open.push({ distance_m, entry });
    }
    this.open.sort((a, b) => a.distance_m - b.distance_m || a.entry.first - b.entry.first);
  }
}

/** Finds cells by place or by id, and remembers the entries that it has met. */
export class CellIndex {
  private readonly entries = new Map<number, CellEntry>();
  private readonly lost: LostPages;

  /** `told` hears once that something of it cannot be had. */
  constructor(
    private readonly scene: PublishedScene,
    told: (error: unknown) => void = () => {},
  ) {
    this.lost = new LostPages(told);
  }

  /** A cell that was met already. */
  known(cell: number): CellEntry | undefined {
    return this.entries.get(cell);
  }

  /** Every cell that was met so far. */
  met(): Iterable<CellEntry> {
    return this.entries.values();
  }

  /** Takes in what another document says of a cell. */
  meet(entry: CellEntry): void {
    this.entries.set(entry.cell, entry);
  }

  /** Reads the chunks nearest to a point, at most so many. */
  async learn(point: Vec3, most_chunks: number): Promise<void> {
    const read = (entry: PageEntry) => this.page(entry, PRIORITY.prefetch);
    let chunks = 0;
    for await (const chunk of nearestChunks(this.scene.manifest.cells, point, read)) {
      if (await this.chunk(chunk, PRIORITY.prefetch)) chunks += 1;
      if (chunks === most_chunks) return;
    }
  }

  /** The cell that surely holds a point, found from a cell near by without a request; else `locate` has to say. */
  nextDoor(from: CellEntry, point: Vec3): CellEntry | undefined {
    return walkTo(from, point, (cell) => this.entries.get(cell));
  }

  /** The cell at a point, or the nearest one of those that can be had. */
  locate(point: Vec3): Promise<Located | undefined> {
    return this.search(new CellSearch(this.scene.manifest.cells, point));
  }

  /** The next cell straight below a point, or the one that holds it; `undefined` when there is none. */
  async below(point: Vec3): Promise<CellEntry | undefined> {
    return (await this.search(new CellSearch(this.scene.manifest.cells, point, dropTo)))?.entry;
  }

  private async search(search: CellSearch): Promise<Located | undefined> {
    for (let wanted = search.wants(); wanted; wanted = search.wants()) {
      const page = wanted.kind === "page" ? await this.page(wanted, PRIORITY.document) : undefined;
      const cells = wanted.kind === "chunk" ? await this.chunk(wanted, PRIORITY.document) : undefined;
      if (page) search.givePage(page);
      else if (cells) search.giveChunk(cells);
      else search.skip();
    }
    // Other documents may have told of cells whose chunk is lost.
    if (this.lost.some) search.consider(this.met());
    return search.finish();
  }

  /** Whether what should say where a cell is cannot be had. */
  isLost(cell: number): boolean {
    return !this.entries.has(cell) && this.lost.holds(cell);
  }

  /** Tries again what could not be had. */
  forgive(retried: Retried): void {
    this.lost.forgive(retried);
  }

  /** Whether part of it cannot be had. */
  get isIncomplete(): boolean {
    return this.lost.some;
  }

  /** What is missing of it. */
  get notes(): readonly string[] {
    return this.lost.notes;
  }

  /** The entries of some cells, but for those that are lost. */
  async entriesOf(cells: readonly number[], priority: number): Promise<CellEntry[]> {
    const found = cells.map(async (cell) => {
      const entry = this.entry(cell, priority);
      return entry.catch((error: unknown) => (this.isLost(cell) ? [] : Promise.reject(error)));
    });
    return (await Promise.all(found)).flat();
  }

  /** The entry of a cell by its id. */
  async entry(cell: number, priority: number): Promise<CellEntry> {
    const known = this.entries.get(cell);
    if (known) return known;
    let page = this.scene.manifest.cells;
    for (;;) {
      const below = entryOf(page, cell);
      if (!below) throw new Error(`the index of cells does not hold c${cell}`);
      if (below.kind === "chunk") {
        const cells = await this.chunk(below, priority);
        const found = cells?.find((entry) => entry.cell === cell);
        if (!cells) throw this.lost.errorOf(below);
        if (!found) throw new Error(`the chunk ${below.url} does not hold c${cell}`);
        return found;
      }
      const next = await this.page(below, priority);
      if (!next) throw this.lost.errorOf(below);
      page = next;
    }
  }

  private page(entry: PageEntry, priority: number): Promise<Page | undefined> {
    return this.lost.unless(entry, () => this.scene.page(entry, priority));
  }

  private async chunk(entry: PageEntry, priority: number): Promise<CellEntry[] | undefined> {
    const cells = await this.lost.unless(entry, () => this.scene.cellChunk(entry, priority));
    for (const cell of cells ?? []) this.meet(cell);
    return cells;
  }
}
