/** In which cell is the eye? Steps next door cost nothing; after a jump the index is asked, and the eye may move on meanwhile. */
import { length, subtract, type Vec3 } from "../basics/geometry.ts";
import type { CellEntry } from "../documents/documents.ts";
import type { Located } from "./cellindex.ts";

/** Whom one asks. */
export interface Locator {
  /** The cell that surely holds a point, found from a cell near by without a request; else `locate` has to say. */
  nextDoor(from: CellEntry, point: Vec3): CellEntry | undefined;
  /** The cell at a point, or the nearest one; `undefined` when there is none. */
  locate(point: Vec3): Promise<Located | undefined>;
}

export interface WhereaboutsEvents {
  /** The eye is in another cell than before. */
  readonly entered: (entry: CellEntry) => void;
  /** The index has answered, or the eye has left its cell or come back into it. */
  readonly located: () => void;
  /** The nearest cell that is known is so far away. */
  readonly outside: (distance_m: number, position: Vec3) => void;
  /** No cell is known anywhere. */
  readonly nowhere: (position: Vec3) => void;
  readonly problem: (error: unknown) => void;
}

export class Whereabouts {
  private position: Vec3 | undefined;
  private current: CellEntry | undefined;
  private isInside = false;
  private asking = false;
  /** Whether to ask again what is being asked, since more of the index may be had now. */
  private isStale = false;
  private closed = false;

  constructor(
    private readonly cells: Locator,
    private readonly events: WhereaboutsEvents,
  ) {}

  /** The cell that holds the eye, or the nearest one. */
  get cell(): CellEntry | undefined {
    return this.current;
  }

  /** Whether the eye is inside that cell. */
  get inside(): boolean {
    return this.isInside;
  }

  /** Whether the index is being asked. */
  get locating(): boolean {
    return this.asking;
  }

  follow(position: Vec3): void {
    this.position = position;
    const next = this.current && this.cells.nextDoor(this.current, position);
    if (next) this.enter(next, true);
    else void this.locate();
  }

  /** Enters the same cell once more, or looks for one. */
  again(): void {
    const { current } = this;
    this.current = undefined;
    if (current) this.enter(current, this.isInside);
    this.isStale = true;
    if (!this.isInside) void this.locate();
  }

  close(): void {
    this.closed = true;
  }

  private async locate(): Promise<void> {
    if (this.asking || !this.position || this.closed) return;
    this.asking = true;
    try {
      let position: Vec3;
      do {
        this.isStale = false;
        position = this.position;
        const located = await this.cells.locate(position);
        if (this.closed) return;
        if (!located) this.events.nowhere(position);
        else {
          this.enter(located.entry, located.distance_m === 0);
          if (located.distance_m > 0) this.events.outside(located.distance_m, position);
        }
        // Who has moved meanwhile asks again: the chunks are here now, and no step is small in every world.
      } while (this.isStale || length(subtract(this.position, position)) > 0);
    } catch (error) {
      this.events.problem(error);
    } finally {
      this.asking = false;
      if (!this.closed) this.events.located();
    }
  }

  private enter(entry: CellEntry, inside: boolean): void {
    if (inside !== this.isInside) {
      this.isInside = inside;
      this.events.located();
    }
    if (this.current?.cell === entry.cell) return;
    this.current = entry;
    this.events.entered(entry);
  }
}
