/**
 * Which cell will the walker enter next, and what is visible from there? The one behind the nearest opening that lies ahead in the direction of travel, as
 * the ray through the last two viewpoints does it (Marvie & Bouatouch, A VRML97-X3D extension for massive scenery
 * management in virtual worlds, 2004, §6.1), but an opening need not be hit exactly.
 */
import type { CellRecord, Portal } from "./cellrecord.ts";
import type { CellRecords } from "./cellrecords.ts";
import { centre, distanceToPolygon, dot, length, subtract, type Vec3 } from "./geometry.ts";
import type { ObjectDirectory, PlacedObject } from "./objects.ts";
import { PRIORITY } from "./priority.ts";

/** An opening further away than this names no cell. */
const RANGE_M = 6;
/** Who moves more slowly stands. */
const SLOWEST_MPS = 0.2;

export function cellAhead(portals: readonly Portal[], position: Vec3, velocity: Vec3): number | undefined {
  if (length(velocity) < SLOWEST_MPS) return undefined;
  let best: { cell: number; distance_m: number } | undefined;
  for (const portal of portals) {
    const distance_m = distanceToPolygon(portal.polygon, position);
    const heading = dot(velocity, subtract(centre(portal.polygon), position)) > 0;
    if (heading && distance_m < Math.min(best?.distance_m ?? Number.POSITIVE_INFINITY, RANGE_M)) {
      best = { cell: portal.to, distance_m };
    }
  }
  return best?.cell;
}

interface Ahead {
  readonly cell: number;
  objects: readonly PlacedObject[];
}

/** Learns what is visible from the neighbour that the walker heads for. */
export class LookAhead {
  private ahead: Ahead | undefined;

  /** `changed` is called when more is known. */
  constructor(
    private readonly records: CellRecords,
    private readonly directory: ObjectDirectory,
    private readonly changed: () => void,
  ) {}

  get cell(): number | undefined {
    return this.ahead?.cell;
  }

  get objects(): readonly PlacedObject[] {
    return this.ahead?.objects ?? [];
  }

  /** Looks from a cell, whose record this is. */
  look(record: CellRecord, position: Vec3, velocity: Vec3): void {
    const cell = cellAhead(record.portals, position, velocity);
    if (cell === undefined || cell === this.ahead?.cell) return;
    this.ahead = { cell, objects: [] };
    void this.prepare(this.ahead);
  }

  forget(): void {
    this.ahead = undefined;
  }

  private async prepare(ahead: Ahead): Promise<void> {
    try {
      const record = await this.records.read(ahead.cell, PRIORITY.prefetch);
      ahead.objects = await this.directory.resolve(this.records.seenFrom(record), PRIORITY.prefetch);
      if (this.ahead === ahead) this.changed();
    } catch {
      // As for neighbours: entering the cell asks again and reports what is wrong.
      if (this.ahead === ahead) this.ahead = undefined;
    }
  }
}
