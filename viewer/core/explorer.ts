/**
 * Which part of the world does this eye need? Ties the pieces together for one scene: eye → cell → record → visible
 * objects → levels and rungs to fetch. Draws nothing itself; what draws is a {@link ModelHost}.
 *
 * While a new cell's record and object infos are on their way, the set of the cell before stays in the picture.
 */
import { CellIndex } from "./cellindex.ts";
import { type CellRecord, visibleObjects } from "./cellrecord.ts";
import { CellRecords } from "./cellrecords.ts";
import { planesOfCell } from "./convex.ts";
import type { CellEntry } from "./documents.ts";
import { areSame, farObjects } from "./farobjects.ts";
import type { FrameBudget } from "./framebudget.ts";
import { length, planesOfHull, subtract, type Vec3 } from "./geometry.ts";
import { type Growing, growing } from "./growing.ts";
import { cellAhead } from "./lookahead.ts";
import { type ModelHost, ModelLoads, type ModelNotes } from "./modelloads.ts";
import { stepsToModels } from "./nearness.ts";
import { ObjectDirectory, type PlacedObject, type Uses } from "./objects.ts";
import { PRIORITY } from "./priority.ts";
import { firstProgress, type Progress, type Shares, shares, sharpProgress } from "./progress.ts";
import type { PublishedScene } from "./published.ts";
import { MemoryShortError, ResidencySet } from "./residency.ts";
import { type Eye, plan, shrink, type Want } from "./scheduler.ts";
import { smoothDecoding } from "./smoothdecoding.ts";
import { SmoothLods } from "./smoothlods.ts";
import type { Surveyed } from "./survey.ts";
import type { NavigationCell, NavigationSpace } from "./walker.ts";

export interface ExplorerOptions {
  readonly memory_limit_bytes: number;
  /** Models are refined until their error covers at most so many pixels. */
  readonly target_px: number;
  readonly uses?: Uses;
  /** Grows models; a worker unless said otherwise. */
  readonly growing?: Growing;
}

export interface ExplorerEvents {
  /** Something that the page shows has changed. */
  readonly changed: () => void;
  /** Something could not be loaded; the walk goes on with what is there. */
  readonly problem: (error: unknown) => void;
}

export class Explorer implements NavigationSpace, Surveyed {
  readonly directory: ObjectDirectory;
  readonly residency: ResidencySet;
  private readonly index: CellIndex;
  private readonly loads: ModelLoads;
  private readonly navigation = new Map<number, NavigationCell>();
  private readonly records: CellRecords;
  /** Doors that are closed. */
  private shutDoors: ReadonlySet<number> = new Set();
  private current: CellEntry | undefined;
  private currentInside = false;
  private shown: readonly PlacedObject[] = [];
  private shownCell: number | undefined;
  private ahead: { cell: number; objects: readonly PlacedObject[] } | undefined;
  private eye: Eye | undefined;
  /** What is drawn by impostors. */
  private far: ReadonlySet<number> = new Set();
  private locating = false;
  /** The cell of which it was said that memory does not suffice for it. */
  private shortIn: number | undefined;
  private closed = false;

  constructor(
    readonly scene: PublishedScene,
    private readonly host: ModelHost,
    budget: FrameBudget,
    private readonly options: ExplorerOptions,
    private readonly events: ExplorerEvents,
  ) {
    this.directory = new ObjectDirectory(scene, options.uses);
    this.index = new CellIndex(scene);
    this.records = new CellRecords(scene, this.index);
    this.residency = new ResidencySet(options.memory_limit_bytes);
    this.loads = new ModelLoads({
      queue: scene.queue,
      tree: scene.tree,
      host,
      residency: this.residency,
      budget,
      growing: options.growing ?? growing(),
      smooth: new SmoothLods(smoothDecoding, (url, bytes) => scene.queue.verdict(url, bytes)),
      changed: () => {
        this.replan();
        events.changed();
      },
      problem: events.problem,
    });
    const whole = this.directory.whole();
    if (whole) this.show(whole, undefined);
  }

  /** The cell that holds the eye, or the nearest one. */
  get cellId(): number | undefined {
    return this.current?.cell;
  }

  /** Whether the eye is inside that cell. */
  get inside(): boolean {
    return this.currentInside;
  }

  /** Where the eye was last. */
  get eyeNow(): Eye | undefined {
    return this.eye;
  }

  /** The cell that is prepared because the walker heads for it. */
  get cellAhead(): number | undefined {
    return this.ahead?.cell;
  }

  get visible(): readonly PlacedObject[] {
    return this.shown;
  }

  /** Downloads and decodings under way. */
  get pending(): number {
    return this.loads.pending + this.scene.queue.pending;
  }

  /** Whether the set of the current cell is what is shown and all of it has at least its coarsest level. */
  get settled(): boolean {
    return this.showsCurrent && !this.locating && this.missing === 0;
  }

  /** Whether what is shown is the set of the current cell. */
  private get showsCurrent(): boolean {
    const rightSet = this.current !== undefined && this.shownCell === this.current.cell;
    return rightSet || this.scene.manifest.whole !== undefined;
  }

  /** Visible objects of which nothing is held yet. */
  get missing(): number {
    return this.shown.filter(({ model }) => !this.residency.held(model.model)).length;
  }

  /** Visible objects of which something is held and yet nothing is drawn: always 0, or there is a fault. */
  get holes(): number {
    return this.shown.filter(({ model, entry }) => this.residency.held(model.model) && !this.host.draws(entry.object))
      .length;
  }

  /** Towards the first picture. */
  progress(): Progress {
    return firstProgress(this.shown, (model) => this.loads.of(model));
  }

  /** Towards a picture that is as sharp as it will get from here. */
  sharpProgress(): Progress {
    if (!this.eye) return { loaded_bytes: 0, total_bytes: 0 };
    return sharpProgress(this.shown, (model) => this.loads.of(model), this.eye, this.options.target_px);
  }

  /** Shares of the visible objects that are here, and that are as sharp as the eye can tell. */
  quality(): Shares | undefined {
    if (!this.eye || !this.showsCurrent) return undefined;
    return shares(this.shown, (model) => this.loads.of(model), this.eye, this.options.target_px);
  }

  /** The hull of a cell for the walker; `undefined` while the cell was not met. */
  cell(id: number): NavigationCell | undefined {
    const known = this.navigation.get(id);
    if (known?.portals) return known;
    const entry = this.index.known(id);
    if (!entry) return undefined;
    const record = this.records.known(id);
    if (known && !record) return known;
    const cell: NavigationCell = {
      cell: id,
      planes: record ? planesOfHull(record.hull.points, record.hull.faces) : planesOfCell(entry),
      adjacent: entry.adjacent,
      portals: record?.portals,
    };
    this.navigation.set(id, cell);
    return cell;
  }

  recordOf(cell: number): CellRecord | undefined {
    return this.records.known(cell);
  }

  entryOf(cell: number): CellEntry | undefined {
    return this.index.known(cell);
  }

  /** Cells that were met so far. */
  knownCells(): Iterable<CellEntry> {
    return this.index.met();
  }

  /** Learns which cells there are around the eye, for a map; at most so many chunks of them. */
  learnCells(most_chunks: number): Promise<void> {
    return this.index.learn(this.eye?.position ?? [0, 0, 0], most_chunks);
  }

  placed(object: number): PlacedObject | undefined {
    return this.directory.known(object);
  }

  holds(model: number): boolean {
    return this.residency.held(model) !== undefined;
  }

  /** What is known of models: how they are drawn, what a finer grade would take, and what could not be had. */
  get models(): ModelNotes {
    return this.loads;
  }

  /** The record of any cell, fetched when needed. */
  record(cell: number): Promise<CellRecord> {
    return this.records.read(cell, PRIORITY.document);
  }

  /** Follows the eye; cheap enough to call in every frame in which it moved. */
  follow(eye: Eye, velocity: Vec3): void {
    this.eye = eye;
    const next = this.current && this.index.nextDoor(this.current, eye.position);
    if (next) this.enter(next, true);
    else void this.locate();
    this.lookAhead(velocity);
    this.replan();
  }

  /** Doors in the openings of the cells that were met. */
  get doors(): ReadonlySet<number> {
    return this.records.doors;
  }

  isShut(door: number): boolean {
    return this.shutDoors.has(door);
  }

  /** Says which doors are closed: what one of them hides is neither shown nor fetched. */
  shutExactly(doors: ReadonlySet<number>): void {
    if (doors.size === this.shutDoors.size && [...doors].every((door) => this.shutDoors.has(door))) return;
    this.shutDoors = new Set(doors);
    this.ahead = undefined;
    if (this.current) void this.arrive(this.current);
  }

  private notBehindDoors(record: CellRecord): number[] {
    const seen = visibleObjects(record).filter(({ doors }) => !doors.some((door) => this.shutDoors.has(door)));
    return seen.map(({ object }) => object);
  }

  /** Tries again what failed. */
  retry(): void {
    this.loads.forgive();
    const current = this.current;
    this.current = undefined;
    if (current) this.enter(current, this.currentInside);
    else void this.locate();
    this.replan();
  }

  close(): void {
    this.closed = true;
    this.loads.close();
  }

  private async locate(): Promise<void> {
    if (this.locating || !this.eye || this.closed) return;
    this.locating = true;
    try {
      let position: Vec3;
      do {
        position = this.eye.position;
        const located = await this.index.locate(position);
        if (this.closed) return;
        if (located) this.enter(located.entry, located.distance_m === 0);
      } while (length(subtract(this.eye.position, position)) > 0.5);
    } catch (error) {
      this.events.problem(error);
    } finally {
      this.locating = false;
    }
  }

  private enter(entry: CellEntry, inside: boolean): void {
    this.currentInside = inside;
    if (this.current?.cell === entry.cell) return;
    this.current = entry;
    this.events.changed();
    void this.arrive(entry);
  }

  private async arrive(entry: CellEntry): Promise<void> {
    try {
      // Neighbours first by name only: the walker needs their hulls before the eye reaches them.
      const neighbours = Promise.all(entry.adjacent.map((cell) => this.index.entry(cell, PRIORITY.document)));
      // Should the record fail first, that is what is told.
      neighbours.catch(() => {});
      const record = await this.records.read(entry.cell, PRIORITY.document);
      if (!this.scene.manifest.whole) {
        const objects = await this.directory.resolve(this.notBehindDoors(record));
        if (this.closed || this.current?.cell !== entry.cell) return;
        this.show(objects, entry.cell);
      }
      const known = await neighbours;
      if (this.closed || this.current?.cell !== entry.cell) return;
      this.events.changed();
      await this.records.learnNeighbours(entry, known);
    } catch (error) {
      if (!this.closed && this.current?.cell === entry.cell) this.events.problem(error);
    }
  }

  private show(objects: readonly PlacedObject[], cell: number | undefined): void {
    this.shown = objects;
    this.shownCell = cell;
    this.residency.need(
      new Set(objects.map(({ model }) => model.model)),
      cell === undefined ? undefined : stepsToModels(cell, this),
    );
    this.host.show(objects);
    this.replan();
    this.events.changed();
  }

  /** Learns what is visible from the neighbour that the walker heads for. */
  private lookAhead(velocity: Vec3): void {
    const record = this.current && this.records.known(this.current.cell);
    if (!record || !this.eye || this.scene.manifest.whole) return;
    const cell = cellAhead(record.portals, this.eye.position, velocity);
    if (cell === undefined || cell === this.ahead?.cell) return;
    const ahead = { cell, objects: [] as readonly PlacedObject[] };
    this.ahead = ahead;
    void this.prepare(ahead);
  }

  private async prepare(ahead: { cell: number; objects: readonly PlacedObject[] }): Promise<void> {
    try {
      const record = await this.records.read(ahead.cell, PRIORITY.prefetch);
      ahead.objects = await this.directory.resolve(this.notBehindDoors(record), PRIORITY.prefetch);
      if (this.ahead === ahead) this.replan();
    } catch {
      // As for neighbours: entering the cell asks again and reports what is wrong.
      if (this.ahead === ahead) this.ahead = undefined;
    }
  }

  private replan(): void {
    if (!this.eye || this.closed) return;
    const { target_px } = this.options;
    const wants = plan(this.shown, this.loads, this.eye, target_px);
    const planned = new Set(wants.map(({ object }) => object.model.model));
    const soon = (this.ahead?.objects ?? []).filter(
      ({ model }) => !planned.has(model.model) && !this.residency.held(model.model),
    );
    const later = PRIORITY.prefetch - PRIORITY.coarsest;
    const early = plan(soon, this.loads, this.eye, target_px);
    wants.push(...early.map((want) => ({ ...want, priority: want.priority + later })));
    if (this.loads.short) this.makeDo(wants);
    this.loads.follow(wants);
    const far = farObjects(this.shown, (model) => this.loads.of(model), this.eye, target_px, this.far);
    if (areSame(far, this.far)) return;
    this.far = far;
    this.host.drawFar(far);
  }

  /** Memory does not hold what is visible: draws something more coarsely, or says that even that does not help. */
  private makeDo(wants: Want[]): void {
    const smaller = shrink(this.shown, (model) => this.residency.held(model));
    if (smaller) wants.unshift(smaller);
    else if (this.loads.pending === 0 && this.shortIn !== this.shownCell) {
      this.shortIn = this.shownCell;
      this.events.problem(new MemoryShortError(this.residency.limit_bytes));
    }
  }
}
