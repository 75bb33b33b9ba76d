/**
 * What can be seen from where the eye is? Finds its cell, reads what the record of that names, and then what is next door. While
 * that is on its way, the set of the cell before stays in the picture; where no cell says what can be seen, what is around counts.
 * Where even that cannot be had for now, nobody knows what can be seen, and what is known of it is shown, or what was shown before.
 */
import type { CellIndex } from "../atlas/cellindex.ts";
import type { CellRecords } from "../atlas/cellrecords.ts";
import type { ObjectDirectory } from "../atlas/objects.ts";
import type { PublishedScene } from "../atlas/published.ts";
import { Starts } from "../atlas/starts.ts";
import { Surroundings } from "../atlas/surroundings.ts";
import { Whereabouts } from "../atlas/whereabouts.ts";
import { distanceToCell } from "../basics/convex.ts";
import { length, subtract, type Vec3 } from "../basics/geometry.ts";
import type { CellRecord } from "../documents/cellrecord.ts";
import type { CellEntry } from "../documents/documents.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import { type Loss, mayRetry, type Retried } from "../fetch/losses.ts";
import { Gate } from "../pace/gate.ts";
import { PRIORITY } from "../strategy/priority.ts";
import type { Scope } from "../strategy/progress.ts";
import { isSameSight, NOTHING_IN_SIGHT, type Sight } from "../strategy/visible.ts";

export interface OutlookParts {
  readonly scene: PublishedScene;
  readonly directory: ObjectDirectory;
  readonly index: CellIndex;
  readonly records: CellRecords;
}

export interface OutlookEvents {
  /** What can be seen is another set, or more of it is known. */
  readonly shown: (sight: Sight) => void;
  /** The index has answered, or the eye has left its cell or come back into it. */
  readonly located: () => void;
  /** It is time to look anew at what is wanted. */
  readonly learnt: () => void;
  /** Something that a page shows has changed. */
  readonly changed: () => void;
  readonly problem: (error: unknown) => void;
}

/** What the record of a cell says of it. */
interface Told {
  readonly cell: number;
  /** What no closed door hides, the most important first. */
  readonly ids: readonly number[];
  readonly coarsest_bytes: number;
  readonly isHiding: boolean;
}

/** What can be seen from a cell. */
interface Beheld {
  readonly ids: readonly number[];
  /** Shows those of it that are known, when the others cannot be had, or yet. */
  readonly see: (objects: readonly PlacedObject[], others?: "lost" | "coming") => void;
  /** Why that is not all known. */
  readonly loss?: Loss | undefined;
}

export class Outlook {
  /** To be opened when one walks. */
  readonly walked = new Gate();
  private readonly starts: Starts;
  private readonly whereabouts: Whereabouts;
  private readonly surroundings: Surroundings;
  private position: Vec3 | undefined;
  private shown: Sight = NOTHING_IN_SIGHT;
  private told: Told | undefined;
  /** Shows what is known of what can be seen from the cell where one is, while the rest is on its way. */
  private showSoFar: () => void = () => {};
  /** How often a cell was entered, or looked at anew because of a door. */
  private arrivals = 0;
  /** Whether all that is around is shown, because no cell says what can be seen. */
  private isAround = false;
  /** Whether something of what is around may come yet. */
  private lacksAround = false;
  /** The cell from which it was begun to learn what is next door. */
  private surveyed: number | undefined;
  /** Why it is not known what can be seen from the current cell, or what is next door. */
  private loss: Loss | undefined;
  /** Where the eye entered the last cell that held it, or began. */
  private entered: Vec3 | undefined;
  /** Whether what is around counts because all known cells are too far away. */
  private hasStrayed = false;
  private closed = false;

  constructor(
    private readonly parts: OutlookParts,
    private readonly events: OutlookEvents,
  ) {
    const { scene, directory, index } = parts;
    this.surroundings = new Surroundings(scene, directory, events.problem);
    this.starts = new Starts(scene, index, directory, () => this.showSoFar());
    this.whereabouts = new Whereabouts(this.starts, {
      entered: (entry) => {
        if (this.inside || !this.entered) this.entered = this.position;
        events.changed();
        void this.arrive(entry);
      },
      located: () => {
        if (this.hasStrayed && this.inside) this.renew();
        events.located();
      },
      outside: (distance_m, position) => this.stray(distance_m, position),
      nowhere: (position) => void this.lookAround(position, () => this.sight.cell !== undefined),
      problem: events.problem,
    });
  }

  /** The cell that holds the eye, or the nearest one. */
  get cell(): CellEntry | undefined {
    return this.whereabouts.cell;
  }

  get cellId(): number | undefined {
    return this.cell?.cell;
  }

  /** Whether the eye is inside that cell. */
  get inside(): boolean {
    return this.whereabouts.inside;
  }

  /** Whether the index is being asked where the eye is. */
  get locating(): boolean {
    return this.whereabouts.locating;
  }

  /** What is shown. */
  get sight(): Sight {
    return this.shown;
  }

  /** Whether what is shown is the set of the current cell, and the eye is in no other. */
  get knowsItsPlace(): boolean {
    return this.showsCurrent && !this.locating;
  }

  /** Whether what is shown is the set of the current cell. */
  get showsCurrent(): boolean {
    const rightSet = this.cellId !== undefined && this.sight.cell === this.cellId && !this.hasStrayed;
    return rightSet || this.isAround || this.parts.scene.manifest.whole !== undefined;
  }

  /** Whether it was begun to learn what is next door to the cell whose set is shown. */
  get hasSurveyed(): boolean {
    return this.surveyed === this.sight.cell;
  }

  /** What can be seen from the current cell, as far as that is known. */
  scope(): Scope | undefined {
    const { sight, told } = this;
    const { scene, directory } = this.parts;
    if (this.isAround && this.locating) return undefined;
    if (scene.manifest.whole || this.isAround) return { ...sight, told_bytes: undefined, isHiding: false };
    if (!told || told.cell !== this.cellId || this.locating || this.hasStrayed) return undefined;
    const isShown = sight.cell === told.cell && sight.count === told.ids.length;
    const objects = isShown ? sight.objects : told.ids.flatMap((id) => directory.beheld(id) ?? []);
    return { objects, count: told.ids.length, told_bytes: told.coarsest_bytes, isHiding: told.isHiding };
  }

  /** Follows the eye. */
  follow(position: Vec3): void {
    if (position === this.position) return;
    this.position = position;
    this.whereabouts.follow(position);
  }

  /** Shows everything where all of a small world came with its manifest. */
  showWhole(): void {
    const objects = this.parts.directory.whole();
    if (objects) this.show({ cell: undefined, objects, count: objects.length });
  }

  /** Looks anew from the current cell: other doors are closed. */
  renew(): void {
    if (this.cell) void this.arrive(this.cell);
  }

  /** Something takes long: unless what is shown belongs to where one is, or next door, what is around is shown until it comes. */
  goOnWithout(): void {
    const { position } = this;
    this.starts.late.open();
    this.showSoFar();
    this.surroundings.tell();
    if (this.closed || !position || this.parts.scene.manifest.whole || this.showsNear) return;
    void this.lookAround(position, () => this.showsNear, "meanwhile");
  }

  /** Whether what is shown can be seen from where one is, or from next door. */
  private get showsNear(): boolean {
    const { cell, sight, position } = this;
    if (this.knowsItsPlace) return true;
    if (!cell || !position || sight.cell === undefined) return false;
    const isNextDoor = sight.cell === cell.cell || cell.adjacent.includes(sight.cell);
    return isNextDoor && distanceToCell(cell, position) < this.surroundings.strayed_m;
  }

  /** Tries again what failed. */
  retry(retried: Retried): void {
    this.starts.forgive(retried);
    if (this.loss && !mayRetry(this.loss, retried) && !this.lacksAround) return;
    this.surroundings.forget();
    if (this.hasStrayed && this.position) this.whereabouts.follow(this.position);
    else this.whereabouts.again();
  }

  close(): void {
    this.closed = true;
    this.whereabouts.close();
  }

  private async arrive(entry: CellEntry): Promise<void> {
    const { directory, index, records } = this.parts;
    const { cell } = entry;
    this.arrivals += 1;
    this.loss = undefined;
    this.hasStrayed = false;
    this.showSoFar = () => {};
    const arrival = this.arrivals;
    const hasLeft = () => this.closed || this.arrivals !== arrival;
    const beheld = this.behold(cell, hasLeft);
    // When that is over, all that is missing here is asked for, or nobody will know what is. Hulls next door come next; who walks
    // already cannot wait for that.
    const neighbours = Promise.race([Promise.allSettled([beheld]), this.walked.next()]).then(async () =>
      hasLeft() ? [] : index.entriesOf(entry.adjacent, PRIORITY.due),
    );
    // Should the record fail first, that is what is told.
    neighbours.catch(() => {});
    try {
      const { ids, see, loss } = await beheld;
      const known = () => ids.flatMap((id) => directory.beheld(id) ?? []);
      const resolved = directory.resolve(ids, PRIORITY.finer).then((exact) => {
        see(known(), "lost");
        return exact.loss;
      });
      // Should a neighbour fail first, that is what is told.
      resolved.catch(() => {});
      const nextDoor = await neighbours;
      if (hasLeft()) return;
      this.events.changed();
      const learnt = records.learnNeighbours(entry, nextDoor);
      this.surveyed = cell;
      this.loss = loss;
      this.events.learnt();
      const [inexact] = await Promise.all([resolved, learnt]);
      if (!hasLeft()) this.loss ??= inexact;
    } catch (error) {
      if (hasLeft()) return;
      this.loss = { error };
      this.events.problem(error);
      // What was seen from somewhere else says nothing of what is here.
      const showsOther = this.sight.cell !== cell && !this.parts.scene.manifest.whole;
      if (showsOther && this.position) void this.lookAround(this.position, hasLeft);
    }
  }

  /** Where the nearest cell that is known is far, because part of the map is lost, it does not say what can be seen here. */
  private stray(distance_m: number, position: Vec3): void {
    const { index, scene } = this.parts;
    const gone_m = length(subtract(position, this.entered ?? position));
    if (scene.manifest.whole) return;
    const isFar = Math.min(distance_m, gone_m) >= this.surroundings.strayed_m;
    if (!index.isIncomplete || !isFar) {
      // The nearest cell says again what can be seen; unless what is around is in the picture, which shall not change at each step.
      if (this.hasStrayed && !(index.isIncomplete && this.isAround)) this.renew();
      return;
    }
    if (!this.hasStrayed) this.arrivals += 1;
    this.hasStrayed = true;
    const { arrivals } = this;
    void this.lookAround(position, () => this.arrivals !== arrivals);
  }

  /**
   * Shows what there is around, where nothing says what can be seen: no cell is known, or not what the first one sees. What is shown
   * meanwhile, until that is known, is never all.
   */
  private async lookAround(position: Vec3, isOver: () => boolean, how?: "meanwhile"): Promise<void> {
    // What is around somewhere else says nothing of what is here.
    if (!this.surroundings.covers(position)) this.isAround = false;
    const some = (objects: readonly PlacedObject[]) => {
      if (this.closed || isOver() || objects.length === 0) return;
      this.show({ cell: undefined, objects, count: objects.length });
      this.events.learnt();
    };
    const around = await this.surroundings.look(position, some, how);
    if (this.closed || !around || isOver()) return;
    const { objects } = around;
    const isAll = around.isAll && how !== "meanwhile";
    if (how === "meanwhile") this.surroundings.forget();
    else this.lacksAround = !isAll;
    this.isAround = isAll;
    if (isAll || objects.length > 0) this.show({ cell: undefined, objects, count: objects.length });
    this.events.learnt();
    this.events.changed();
  }

  /** Shows what can be seen from a cell as soon as it can be drawn; answers with all of it, and with how to show more of that. */
  private async behold(cell: number, hasLeft: () => boolean): Promise<Beheld> {
    const { scene, directory, records } = this.parts;
    const record = await records.read(cell, PRIORITY.document);
    // All of a small world is shown from everywhere.
    if (scene.manifest.whole) return { ids: [], see: () => {} };
    const ids = records.seenFrom(record);
    const see: Beheld["see"] = (objects, others = "coming") => {
      const lost = others === "lost" ? ids.length - objects.length : 0;
      if (!hasLeft()) this.show({ cell, objects, count: ids.length, lost });
    };
    if (!hasLeft()) this.hear(record, ids);
    const known = () => ids.flatMap((id) => directory.beheld(id) ?? []);
    this.showSoFar = () => {
      const some = known();
      if (some.length > 0) see(some);
    };
    const first = await directory.behold(ids, undefined, see);
    if (!hasLeft()) this.showSoFar = () => {};
    const isMore = first.loss && (await this.starts.takeFor(cell));
    const { objects, loss } = isMore ? await directory.behold(ids) : first;
    if (loss && objects.length === 0) throw loss.error;
    see(objects, "lost");
    return { ids, see, loss };
  }

  private hear(record: CellRecord, ids: readonly number[]): void {
    const isHiding = ids.length < record.lpvs.length + record.opvs.length;
    this.told = { cell: record.cell, ids, coarsest_bytes: record.visibleCoarsestBytes, isHiding };
    this.events.changed();
  }

  private show(sight: Sight): void {
    if (sight.cell !== undefined) {
      this.isAround = false;
      this.lacksAround = false;
      this.surroundings.forget();
    }
    if (isSameSight(sight, this.sight)) return;
    this.shown = sight;
    this.events.shown(sight);
  }
}
