/**
 * Which part of the world does this eye need? Ties the pieces together for one scene: eye → cell → record → visible
 * objects → levels and rungs to fetch. Draws nothing itself; what draws is a {@link ModelHost}.
 *
 * While a new cell's record and the first of what it names are on their way, the set of the cell before stays in the picture.
 */
import { CellIndex } from "./cellindex.ts";
import type { CellRecord } from "./cellrecord.ts";
import { CellRecords } from "./cellrecords.ts";
import { nearestPoint } from "./convex.ts";
import type { CellEntry } from "./documents.ts";
import { areSame, farObjects } from "./farobjects.ts";
import type { FrameBudget } from "./framebudget.ts";
import { Gate } from "./gate.ts";
import { length, subtract, type Vec3 } from "./geometry.ts";
import { type Growing, growing } from "./growing.ts";
import { LookAhead } from "./lookahead.ts";
import { type ModelHost, ModelLoads, type ModelNotes } from "./modelloads.ts";
import { MetCells } from "./navigation.ts";
import { stepsToModels } from "./nearness.ts";
import { ObjectDirectory, type PlacedObject, type Uses } from "./objects.ts";
import { Pacer } from "./pacer.ts";
import { PRIORITY, type Want } from "./priority.ts";
import { type CameOf, firstProgress, type HoldingOf, type Progress, type Scope, sharpProgress } from "./progress.ts";
import type { PublishedScene } from "./published.ts";
import { MemoryShortError, ResidencySet } from "./residency.ts";
import { shrink, targetWithin, wanted } from "./scheduler.ts";
import type { Eye } from "./screenerror.ts";
import { isSameSight, NOTHING_IN_SIGHT, type Shares, type Sight, shares } from "./sight.ts";
import { smoothDecoding } from "./smoothdecoding.ts";
import { SmoothLods } from "./smoothlods.ts";
import { Starts } from "./starts.ts";
import { statureIn } from "./stature.ts";
import { Surroundings } from "./surroundings.ts";
import type { Surveyed } from "./survey.ts";
import type { NavigationCell, NavigationSpace } from "./walker.ts";
import { Whereabouts } from "./whereabouts.ts";

export interface ExplorerOptions {
  readonly memory_limit_bytes: number;
  /** Models are refined until their error covers at most so many pixels. */
  readonly target_px: number;
  /** Triangles of all that is visible; models are refined less where it would take more. Unlimited unless given. */
  readonly most_triangles?: number;
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

/** Who has moved so far, or goes so much faster or elsewhere, looks anew at what is wanted. */
const [MOVED_M, CHANGED_MPS] = [0.25, 0.5];

/** Of what comes one after the other within this time, only the first is looked at by itself. */
const PAUSE_MS = 15;

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
  readonly see: (objects: readonly PlacedObject[]) => void;
}

export class Explorer implements NavigationSpace, Surveyed {
  readonly directory: ObjectDirectory;
  readonly residency: ResidencySet;
  /** Of who goes through it, as a share of a person's. */
  private readonly size: number;
  private readonly index: CellIndex;
  private readonly loads: ModelLoads;
  private readonly navigation: MetCells;
  private readonly records: CellRecords;
  private readonly whereabouts: Whereabouts;
  private sight: Sight = NOTHING_IN_SIGHT;
  private readonly ahead: LookAhead;
  private told: Told | undefined;
  private eye: Eye | undefined;
  private velocity_mps: Vec3 = [0, 0, 0];
  /** The eye and its velocity as it was last looked at what is wanted; nothing before the first look. */
  private planned: { readonly eye: Eye; readonly velocity_mps: Vec3 } | undefined;
  private target_px: number;
  /** What is drawn by impostors. */
  private far: ReadonlySet<number> = new Set();
  /** How often a cell was entered, or looked at anew because of a door. */
  private arrivals = 0;
  /** The cell of which it was said that memory does not suffice for it. */
  private shortIn: number | undefined;
  private closed = false;
  private readonly surroundings: Surroundings;
  /** Whether what is around is shown, because no cell says what can be seen. */
  private isAround = false;
  /** Whether the eye was, or may have been, in another cell when it was last planned: one needs to know what is there before anything gets finer here. */
  private isElsewhere = false;
  /** The cell from which it was begun to learn what is next door. */
  private surveyed: number | undefined;
  /** Opened when something is here of all that can be seen … */
  private readonly pictured = new Gate();
  /** … and when one walks. */
  private readonly walked = new Gate();
  private readonly planning = new Pacer(() => this.replan(), PAUSE_MS);
  private readonly holdingOf: HoldingOf = (model) => this.loads.of(model);
  private readonly cameOf: CameOf = (model, file) => this.loads.came_bytes(model, file);

  constructor(
    readonly scene: PublishedScene,
    private readonly host: ModelHost,
    budget: FrameBudget,
    private readonly options: ExplorerOptions,
    private readonly events: ExplorerEvents,
  ) {
    this.target_px = options.target_px;
    this.size = statureIn(scene.manifest).size;
    this.directory = new ObjectDirectory(scene, options.uses);
    this.index = new CellIndex(scene, events.problem);
    this.surroundings = new Surroundings(scene, this.directory, events.problem);
    this.records = new CellRecords(scene, this.index);
    this.navigation = new MetCells(this.index, this.records);
    this.residency = new ResidencySet(options.memory_limit_bytes);
    this.loads = new ModelLoads({
      queue: scene.queue,
      tree: scene.tree,
      host,
      residency: this.residency,
      budget,
      growing: options.growing ?? growing(),
      smooth: new SmoothLods(smoothDecoding, (url, bytes) => scene.queue.verdict(url, bytes)),
      changed: (hasGone) => {
        if (hasGone) this.planning.now();
        else this.planning.ask();
        events.changed();
      },
      problem: events.problem,
    });
    this.whereabouts = new Whereabouts(new Starts(scene, this.index, this.directory), {
      entered: (entry) => {
        events.changed();
        void this.arrive(entry);
      },
      located: () => {
        events.changed();
        if (this.isElsewhere && !this.whereabouts.locating) this.planning.ask();
      },
      nowhere: (position) => void this.lookAround(position),
      problem: events.problem,
    });
    this.ahead = new LookAhead(this.records, this.directory, this, () => this.planning.ask());
    const objects = this.directory.whole();
    if (objects) this.show({ cell: undefined, objects, count: objects.length });
  }

  /** The cell that holds the eye, or the nearest one. */
  get cellId(): number | undefined {
    return this.whereabouts.cell?.cell;
  }

  /** Whether the eye is inside that cell. */
  get inside(): boolean {
    return this.whereabouts.inside;
  }

  /** Where a walker can stand who comes down from somewhere: the nearest point of the nearest cell, off its walls. */
  footing(position: Vec3, body_m: number): Vec3 | undefined {
    const { cell } = this.whereabouts;
    return cell && nearestPoint(cell, position, body_m);
  }

  /** Where the eye was last. */
  get eyeNow(): Eye | undefined {
    return this.eye;
  }

  /** Whether a cell is prepared because one may be there soon. */
  prepares(cell: number): boolean {
    return this.ahead.prepares(cell);
  }

  /** Models are refined until their error covers so many pixels, as far as there are triangles for it. */
  get refinedTo_px(): number {
    return this.target_px;
  }

  /** What can be seen, as far as it is known. */
  get visible(): readonly PlacedObject[] {
    return this.sight.objects;
  }

  /** How many objects can be seen, known or not. */
  get visibleCount(): number {
    return this.sight.count;
  }

  /** Downloads and decodings under way. */
  get pending(): number {
    return this.loads.pending + this.scene.queue.pending + (this.planning.isAsked ? 1 : 0);
  }

  /** Whether the set of the current cell is what is shown and all of it has at least its coarsest level. */
  get settled(): boolean {
    return this.knowsItsPlace && this.missing === 0;
  }

  /** Whether what is shown is the set of the current cell, and the eye is in no other. */
  private get knowsItsPlace(): boolean {
    return this.showsCurrent && !this.whereabouts.locating;
  }

  /** Whether what is shown is the set of the current cell. */
  private get showsCurrent(): boolean {
    const rightSet = this.cellId !== undefined && this.sight.cell === this.cellId;
    return rightSet || this.isAround || this.scene.manifest.whole !== undefined;
  }

  /** Visible objects of which nothing is held yet; nothing while nobody knows what can be seen. */
  get missing(): number | undefined {
    const scope = this.scope();
    return scope && scope.count - scope.objects.filter(({ model }) => this.holds(model.model)).length;
  }

  /** Visible objects of which something is held and yet nothing is drawn: always 0, or there is a fault. */
  get holes(): number {
    const isHole = ({ model, entry }: PlacedObject) =>
      this.residency.held(model.model) && !this.host.draws(entry.object);
    return this.visible.filter(isHole).length;
  }

  /** Towards the first picture; nothing while nobody knows what can be seen. */
  progress(): Progress | undefined {
    const scope = this.scope();
    return scope && firstProgress(scope, this.holdingOf, this.cameOf);
  }

  /** Towards a picture that is as sharp as it will get from here. */
  sharpProgress(): Progress | undefined {
    const scope = this.scope();
    return scope && this.eye && sharpProgress(scope, this.holdingOf, this.eye, this.target_px, this.cameOf);
  }

  /** Shares of the visible objects that are here, and that are as sharp as the eye can tell. */
  quality(): Shares | undefined {
    if (!this.eye || !this.showsCurrent) return undefined;
    return shares(this.sight, this.holdingOf, this.eye, this.target_px);
  }

  /** The hull of a cell for the walker; `undefined` while the cell was not met. */
  cell(id: number): NavigationCell | undefined {
    return this.navigation.cell(id);
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

  /** Whether something of a model is held or on its way. */
  wants(model: number): boolean {
    return this.holds(model) || this.loads.isComing(model);
  }

  /** What is drawn otherwise than it could be, and why. */
  get notes(): readonly string[] {
    return [...this.index.notes, ...this.directory.notes, ...this.loads.notes];
  }

  /** What is known of models: how they are drawn, what a finer grade would take, and what could not be had. */
  get models(): ModelNotes {
    return this.loads;
  }

  /** The record of any cell, fetched when needed. */
  record(cell: number): Promise<CellRecord> {
    return this.records.read(cell, PRIORITY.document);
  }

  /** Follows the eye; cheap enough to call in every frame. */
  follow(eye: Eye, velocity_mps: Vec3): void {
    const before = this.eye;
    this.eye = eye;
    this.velocity_mps = velocity_mps;
    if (!before || before.position !== eye.position) this.whereabouts.follow(eye.position);
    if (!this.isPlanned(eye)) this.planning.now();
  }

  /** Doors in the openings of the cells that were met. */
  get doors(): ReadonlySet<number> {
    return this.records.doors;
  }

  /** Whether nobody can say where a cell is. */
  isLost(cell: number): boolean {
    return this.index.isLost(cell);
  }

  isShut(door: number): boolean {
    return this.records.isShut(door);
  }

  /** Says which doors are closed: what one of them hides is neither shown nor fetched. */
  shutExactly(doors: ReadonlySet<number>): void {
    if (!this.records.shutExactly(doors)) return;
    this.ahead.renew();
    this.planning.ask();
    const { cell } = this.whereabouts;
    if (cell) void this.arrive(cell);
  }

  /** Tries again what failed. */
  retry(): void {
    this.loads.forgive();
    this.index.forgive();
    this.directory.forgive();
    this.surroundings.forget();
    this.ahead.renew();
    this.whereabouts.again();
    this.planning.now();
  }

  close(): void {
    this.closed = true;
    this.planning.close();
    this.whereabouts.close();
    this.loads.close();
  }

  private async arrive(entry: CellEntry): Promise<void> {
    const { cell } = entry;
    this.arrivals += 1;
    const arrival = this.arrivals;
    const hasLeft = () => this.closed || this.arrivals !== arrival;
    const beheld = this.behold(cell, hasLeft);
    const pictured = beheld.then(
      () => {
        const next = this.pictured.next();
        this.planning.ask();
        return next;
      },
      () => {},
    );
    // The walker needs hulls next door, also where nobody knows what can be seen. Only who stands still can wait for them.
    const neighbours = Promise.race([pictured, this.walked.next()]).then(async () =>
      hasLeft() ? [] : this.index.entriesOf(entry.adjacent, PRIORITY.due),
    );
    // Should the record fail first, that is what is told.
    neighbours.catch(() => {});
    try {
      const { ids, see } = await beheld;
      const resolved = this.directory.resolve(ids, PRIORITY.finer).then(see);
      // Should a neighbour fail first, that is what is told.
      resolved.catch(() => {});
      const [known] = await Promise.all([neighbours, pictured]);
      if (hasLeft()) return;
      this.events.changed();
      const learnt = this.records.learnNeighbours(entry, known);
      this.surveyed = cell;
      this.planning.ask();
      await Promise.all([learnt, resolved]);
    } catch (error) {
      if (hasLeft()) return;
      this.events.problem(error);
      if (this.sight.count === 0 && this.eye) void this.lookAround(this.eye.position);
    }
  }

  /** Shows what there is around, where nothing says what can be seen: no cell is known, or not what the first one sees. */
  private async lookAround(position: Vec3): Promise<void> {
    const objects = await this.surroundings.look(position);
    if (this.closed || !objects || this.sight.cell !== undefined) return;
    this.isAround = true;
    this.show({ cell: undefined, objects, count: objects.length });
    this.events.changed();
  }

  /** Shows what can be seen from a cell as soon as it can be drawn; answers with all of it, and with how to show more of that. */
  private async behold(cell: number, hasLeft: () => boolean): Promise<Beheld> {
    const record = await this.records.read(cell, PRIORITY.document);
    // All of a small world is shown from everywhere.
    if (this.scene.manifest.whole) return { ids: [], see: () => {} };
    const ids = this.records.seenFrom(record);
    const see = (objects: readonly PlacedObject[]) => {
      if (!hasLeft()) this.show({ cell, objects, count: ids.length });
    };
    if (!hasLeft()) this.hear(record, ids);
    see(await this.directory.behold(ids, undefined, see));
    return { ids, see };
  }

  private show(sight: Sight): void {
    const { cell, objects } = sight;
    if (cell !== undefined) this.isAround = false;
    if (isSameSight(sight, this.sight)) return;
    this.sight = sight;
    this.residency.need(
      new Set(objects.map(({ model }) => model.model)),
      cell === undefined ? undefined : stepsToModels(cell, this),
    );
    this.host.show(objects);
    this.planning.now();
    this.events.changed();
  }

  /** What can be seen from the current cell, as far as that is known. */
  private scope(): Scope | undefined {
    const { sight, told, directory } = this;
    if (this.isAround && this.whereabouts.locating) return undefined;
    if (this.scene.manifest.whole || this.isAround) return { ...sight, told_bytes: undefined, isHiding: false };
    if (!told || told.cell !== this.cellId || this.whereabouts.locating) return undefined;
    const isShown = sight.cell === told.cell && sight.count === told.ids.length;
    const objects = isShown ? sight.objects : told.ids.flatMap((id) => directory.beheld(id) ?? []);
    return { objects, count: told.ids.length, told_bytes: told.coarsest_bytes, isHiding: told.isHiding };
  }

  private hear(record: CellRecord, ids: readonly number[]): void {
    const isHiding = ids.length < record.lpvs.length + record.opvs.length;
    this.told = { cell: record.cell, ids, coarsest_bytes: record.visibleCoarsestBytes, isHiding };
    this.events.changed();
  }

  /** Whether what is wanted from near by was looked at. */
  private isPlanned({ position, height_px, viewAngle_rad }: Eye): boolean {
    if (!this.planned) return false;
    const { eye, velocity_mps } = this.planned;
    const isSame = height_px === eye.height_px && viewAngle_rad === eye.viewAngle_rad;
    const isNear = length(subtract(position, eye.position)) < MOVED_M * this.size;
    return isSame && isNear && length(subtract(this.velocity_mps, velocity_mps)) < CHANGED_MPS * this.size;
  }

  /** Makes what is under way equal to what is wanted. */
  private replan(): void {
    const { eye, velocity_mps, ahead, loads, sight } = this;
    if (!eye || this.closed) return;
    this.planned = { eye, velocity_mps };
    const { most_triangles } = this.options;
    this.target_px = this.options.target_px;
    if (most_triangles !== undefined) {
      this.target_px = targetWithin(sight.objects, eye, this.target_px, most_triangles);
    }
    const { bytes_per_s } = this.scene.queue;
    this.isElsewhere = !this.knowsItsPlace;
    const looksAhead = this.cellId !== undefined && this.cellId === sight.cell;
    if (looksAhead && this.cellId !== undefined) ahead.look(this.cellId, eye.position, velocity_mps);
    const view = {
      eye,
      here: sight.objects,
      isAllKnown: sight.objects.length === sight.count && !this.isElsewhere,
      ahead: looksAhead ? ahead.known : [],
    };
    const all = wanted(view, loads, this.target_px, bytes_per_s);
    // What lies ahead is of no use before something of all that can be seen is here: it is not begun.
    const isMissing = all.some(({ cause }) => cause.kind === "missing");
    const mayBegin = ({ object, cause }: Want) => cause.kind !== "ahead" || loads.isComing(object.model.model);
    const wants = isMissing ? all.filter(mayBegin) : all;
    if (looksAhead && this.surveyed === sight.cell && view.isAllKnown && !isMissing) ahead.learn(bytes_per_s);
    // What is on its way to save memory is not begun anew while that is short.
    const smaller = loads.short ? this.smaller() : undefined;
    loads.follow(smaller && loads.isComing(smaller.object.model.model) ? [smaller, ...wants] : wants);
    if (loads.short) this.makeDo(wants);
    if (view.isAllKnown && (!isMissing || loads.short)) this.pictured.open();
    if (length(velocity_mps) > CHANGED_MPS * this.size) this.walked.open();
    const far = farObjects(sight.objects, this.holdingOf, eye, this.target_px, this.far);
    if (areSame(far, this.far)) return;
    this.far = far;
    this.host.drawFar(far);
  }

  /** Memory does not hold what is visible: draws something more coarsely, or says that even that does not help. */
  private makeDo(wants: readonly Want[]): void {
    const smaller = this.smaller();
    if (smaller) this.loads.follow([smaller, ...wants]);
    else if (this.loads.pending === 0 && this.shortIn !== this.sight.cell) {
      this.shortIn = this.sight.cell;
      this.events.problem(new MemoryShortError(this.residency.limit_bytes));
    }
  }

  private smaller(): Want | undefined {
    return shrink(this.visible, (model) => this.residency.base(model));
  }
}
