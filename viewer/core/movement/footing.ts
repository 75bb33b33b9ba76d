/**
 * Where does one stand who comes down from the air? On the ground below, as far down as cells lead on from the next one below the eye;
 * where none lies below, in the nearest one, off its walls.
 */
import type { CellIndex } from "../atlas/cellindex.ts";
import type { CellRecords } from "../atlas/cellrecords.ts";
import { nearestPoint } from "../basics/convex.ts";
import type { Vec3 } from "../basics/geometry.ts";
import type { CellEntry } from "../documents/documents.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { type NavigationSpace, sweep } from "./walker.ts";

/** Where the eye is of who stands there, and in which cell that is. */
export interface Footing {
  readonly position: Vec3;
  readonly cell: number;
}

/** Of who comes down. */
export interface Body {
  /** The distance that is kept from walls. */
  readonly bodyRadius_m: number;
  /** From the floor to the eye. */
  readonly standing_m: number;
}

/** One comes through so many cells at most, and down so far. */
const [MOST_CELLS, DEEPEST_M] = [32, 1e5];

export class Footings {
  constructor(
    private readonly index: CellIndex,
    private readonly records: CellRecords,
    private readonly space: NavigationSpace,
  ) {}

  /** Learns what lies below; `undefined` when no cell is known anywhere. */
  async find(eye: Vec3, body: Body): Promise<Footing | undefined> {
    const entry = (await this.index.below(eye)) ?? (await this.index.locate(eye))?.entry;
    if (!entry) return undefined;
    for (let cell = entry, cells = 0; ; cells += 1) {
      // What cannot be had is done without: who stands where it leads on goes down later.
      const met = [
        this.records.read(cell.cell, PRIORITY.document),
        this.index.entriesOf(cell.adjacent, PRIORITY.document),
      ];
      await Promise.allSettled(met);
      const footing = this.within(entry, eye, body);
      const lower = footing && this.index.known(footing.cell);
      if (!lower || lower.cell === cell.cell || cells === MOST_CELLS) return footing;
      cell = lower;
    }
  }

  /** Where one stands who comes down in a cell, and through those below it that are known. */
  within(entry: CellEntry, eye: Vec3, { bodyRadius_m, standing_m }: Body): Footing | undefined {
    const cell = this.space.cell(entry.cell);
    if (!cell) return undefined;
    const position = nearestPoint(entry, eye, bodyRadius_m);
    const floor = sweep(this.space, { position, cell }, [0, -DEEPEST_M, 0], "stop");
    const stood = sweep(this.space, floor, [0, standing_m, 0], "stop");
    return { position: stood.position, cell: stood.cell.cell };
  }
}
