/**
 * What is visible from which cell, as far as it was learnt, and with which doors closed? Records come alone, or as steps from the
 * cell next door where that costs less, or where the record is lost.
 */
import { type CellRecord, type DecodedRecord, followStep, visibleObjects } from "../documents/cellrecord.ts";
import type { CellEntry } from "../documents/documents.ts";
import { passes } from "../fetch/losses.ts";
import { HEADER_BYTES } from "../strategy/file.ts";
import { PRIORITY } from "../strategy/priority.ts";
import type { CellIndex } from "./cellindex.ts";
import type { PublishedScene } from "./published.ts";

export class CellRecords {
  private readonly records = new Map<number, DecodedRecord>();
  private readonly doorways = new Set<number>();
  private shut: ReadonlySet<number> = new Set();
  /** The cell whose neighbours are learnt from its steps. */
  private stepping: { readonly entry: CellEntry; readonly decoded: DecodedRecord } | undefined;

  constructor(
    private readonly scene: PublishedScene,
    private readonly index: CellIndex,
  ) {}

  /** Doors that close an opening of a cell that was read. */
  get doors(): ReadonlySet<number> {
    return this.doorways;
  }

  isShut(door: number): boolean {
    return this.shut.has(door);
  }

  /** Says which doors are closed; answers whether others were before. */
  shutExactly(doors: ReadonlySet<number>): boolean {
    if (doors.size === this.shut.size && [...doors].every((door) => this.shut.has(door))) return false;
    this.shut = new Set(doors);
    return true;
  }

  /** Objects that no closed door hides, the most important first. */
  seenFrom(record: CellRecord): number[] {
    const seen = visibleObjects(record).filter(({ doors }) => !doors.some((door) => this.shut.has(door)));
    return seen.map(({ object }) => object);
  }

  known(cell: number): CellRecord | undefined {
    return this.records.get(cell)?.record;
  }

  /** The record of any cell, fetched when needed. */
  async read(cell: number, priority: number): Promise<CellRecord> {
    const known = this.records.get(cell) ?? (await this.stepped(cell, priority));
    const decoded = known ?? (await this.somehow(await this.index.entry(cell, priority), priority));
    this.records.set(cell, decoded);
    for (const { door } of decoded.record.portals) if (door !== undefined) this.doorways.add(door);
    return decoded.record;
  }

  /** The record of a neighbour of the cell whose steps are wanted anyway; `undefined` when they do not lead there. */
  private async stepped(cell: number, priority: number): Promise<DecodedRecord | undefined> {
    const from = this.stepping;
    if (!from?.entry.adjacent.includes(cell)) return undefined;
    // The record itself is still to be had, and says what is wrong when it is not.
    return this.step(from.entry, cell, priority, async () => from.decoded).catch(() => undefined);
  }

  /** A cell's own record; where that is lost, what the record of a cell next door and the step from there say, as in `client/src/records.rs`. */
  private async somehow(entry: CellEntry, priority: number): Promise<DecodedRecord> {
    try {
      return await this.scene.record(entry, priority);
    } catch (error) {
      if (passes(error)) throw error;
      for (const next of await this.index.entriesOf(entry.adjacent, priority)) {
        const from = async () => this.records.get(next.cell) ?? this.scene.record(next, priority);
        // A neighbour of which nothing can be had, either, is no failure of this cell.
        const stepped = await this.step(next, entry.cell, priority, from).catch(() => undefined);
        if (stepped) return stepped;
      }
      throw error;
    }
  }

  /** The record of a cell next door to another, whose record `read` brings; `undefined` when its steps do not lead there. */
  private async step(
    from: CellEntry,
    cell: number,
    priority: number,
    read: () => Promise<DecodedRecord>,
  ): Promise<DecodedRecord | undefined> {
    const step = (await this.scene.steps(from, priority))?.to.get(cell);
    const decoded = step && (await this.scene.decodePieces(followStep(await read(), step)));
    return decoded?.record.cell === cell ? decoded : undefined;
  }

  /** Learns what is visible from every neighbour: from one object with all steps where that costs less. */
  async learnNeighbours(entry: CellEntry, neighbours: readonly CellEntry[]): Promise<void> {
    const unknown = neighbours.filter(({ cell }) => !this.records.has(cell));
    const apart = unknown.reduce((sum, { recordBytes }) => sum + recordBytes + HEADER_BYTES, 0);
    const decoded = this.records.get(entry.cell);
    if (decoded && entry.steps && entry.steps.bytes + HEADER_BYTES < apart) this.stepping = { entry, decoded };
    // Nothing depends on these yet; entering a cell asks again and reports what is wrong.
    await Promise.allSettled(unknown.map(({ cell }) => this.read(cell, PRIORITY.prefetch)));
  }
}
