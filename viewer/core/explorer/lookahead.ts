/**
 * What can be seen from the cells that may be entered soon? Learns it in time (`strategy/ahead.ts`): documents of what is nearly
 * due come before anything finer, those of the others last.
 */
import type { CellRecords } from "../atlas/cellrecords.ts";
import type { ObjectDirectory } from "../atlas/objects.ts";
import type { Vec3 } from "../basics/geometry.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import { type Loss, mayRetry, type Retried } from "../fetch/losses.ts";
import { type Approach, approaches, type KnownCells, whenToKnow } from "../strategy/ahead.ts";
import type { Ahead } from "../strategy/planner.ts";
import { PRIORITY } from "../strategy/priority.ts";

/** A cell that was asked for. */
interface Place {
  /** What can be seen from there, or could be when that was last learnt; unknown while its documents travel. */
  objects: readonly PlacedObject[] | undefined;
  /** How urgently its documents were asked for; most of all once they are here, so that nobody asks again. */
  priority: number;
  /** Why its documents cannot be had. */
  loss?: Loss;
}

export class LookAhead {
  private readonly places = new Map<number, Place>();
  private coming: readonly Approach[] = [];

  /** `changed` is called when more is known. */
  constructor(
    private readonly records: CellRecords,
    private readonly directory: ObjectDirectory,
    private readonly cells: KnownCells,
    private readonly changed: () => void,
  ) {}

  /** Cells that may be entered and of which one knows what can be seen from there; of each model the most important object. */
  get known(): Ahead[] {
    return this.coming.flatMap((approach) => {
      const objects = this.places.get(approach.cell)?.objects;
      return objects ? { ...approach, objects } : [];
    });
  }

  /** Whether a cell is being prepared. */
  prepares(cell: number): boolean {
    return this.coming.some((approach) => approach.cell === cell) && this.places.has(cell);
  }

  /** Looks from a position in a cell. */
  look(here: number, position: Vec3, velocity_mps: Vec3): void {
    this.coming = approaches(here, this.cells, position, velocity_mps);
  }

  /** Learns what can be seen from cells that it is time for. */
  learn(bytes_per_s: number): void {
    for (const { cell, in_s } of this.coming) {
      const when = whenToKnow(in_s, bytes_per_s);
      if (when === "not yet") continue;
      const priority = when === "due" ? PRIORITY.due : PRIORITY.prefetch;
      const place = this.places.get(cell) ?? unlearnt(undefined);
      if (place.priority <= priority) continue;
      place.priority = priority;
      this.places.set(cell, place);
      void this.read(cell, place);
    }
  }

  /** All of it is to be learnt anew, and what is known serves until then. */
  renew(): void {
    for (const [cell, { objects }] of this.places) this.places.set(cell, unlearnt(objects));
  }

  /** What could not be learnt is to be learnt anew. */
  retry(retried: Retried): void {
    for (const [cell, { objects, loss }] of this.places) {
      if (loss && mayRetry(loss, retried)) this.places.set(cell, unlearnt(objects));
    }
  }

  private async read(cell: number, place: Place): Promise<void> {
    const { priority } = place;
    try {
      const record = await this.records.read(cell, priority);
      const ids = this.records.seenFrom(record);
      const { objects, loss } = await this.directory.behold(ids, { documents: priority, models: priority });
      place.objects = ofEachModel(objects);
      if (loss) place.loss = loss;
      place.priority = Number.NEGATIVE_INFINITY;
      if (this.places.get(cell) === place) this.changed();
    } catch (error) {
      place.loss = { error };
      // As for neighbours: entering the cell asks again and reports what is wrong.
    }
  }
}

function unlearnt(objects: Place["objects"]): Place {
  return { objects, priority: Number.POSITIVE_INFINITY };
}

/** Of each model the first object. */
function ofEachModel(objects: readonly PlacedObject[]): PlacedObject[] {
  const first = new Map<number, PlacedObject>();
  for (const object of objects) if (!first.has(object.model.model)) first.set(object.model.model, object);
  return [...first.values()];
}
