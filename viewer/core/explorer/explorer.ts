/**
 * Which part of the world does this eye need, and how far is it with that? Ties the pieces together for one scene: eye → cell →
 * record → visible objects (`outlook.ts`) → levels and rungs to fetch (`replanner.ts`). Draws nothing itself; what draws is a
 * {@link ModelHost}.
 */
import { CellIndex } from "../atlas/cellindex.ts";
import { CellRecords } from "../atlas/cellrecords.ts";
import { ObjectDirectory, type Uses } from "../atlas/objects.ts";
import type { PublishedScene } from "../atlas/published.ts";
import { Republication } from "../atlas/republication.ts";
import type { Surveyed } from "../atlas/survey.ts";
import type { Vec3 } from "../basics/geometry.ts";
import type { CellRecord } from "../documents/cellrecord.ts";
import type { CellEntry } from "../documents/documents.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import type { Retried } from "../fetch/losses.ts";
import { Recovery } from "../fetch/recovery.ts";
import { pause } from "../fetch/transfer.ts";
import { type Growing, growing } from "../models/growing.ts";
import { type ModelHost, ModelLoads, type ModelNotes } from "../models/modelloads.ts";
import { smoothDecoding } from "../models/smoothdecoding.ts";
import { SmoothLods } from "../models/smoothlods.ts";
import type { Pose } from "../movement/address.ts";
import { type Astray, astray, isFar } from "../movement/astray.ts";
import { type Body, type Footing, Footings } from "../movement/footing.ts";
import { MetCells } from "../movement/navigation.ts";
import { statureIn } from "../movement/stature.ts";
import type { NavigationCell, NavigationSpace } from "../movement/walker.ts";
import type { FrameBudget } from "../pace/framebudget.ts";
import { stepsToModels } from "../strategy/nearness.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { type CameOf, firstProgress, type HoldingOf, type Progress, sharpProgress } from "../strategy/progress.ts";
import { ResidencySet } from "../strategy/residency.ts";
import { siblingsIn } from "../strategy/siblings.ts";
import type { Eye } from "../strategy/sight.ts";
import { type Shares, type Sight, shares } from "../strategy/visible.ts";
import { LookAhead } from "./lookahead.ts";
import { Outlook } from "./outlook.ts";
import { Replanner, type Targets } from "./replanner.ts";

/** Who comes down waits no longer to learn what lies below. */
const LANDING_MS = 2000;

export interface ExplorerOptions extends Targets {
  readonly memory_limit_bytes: number;
  readonly uses?: Uses;
  /** Grows models; a worker unless said otherwise. */
  readonly growing?: Growing;
}

export interface ExplorerEvents {
  /** Something that the page shows has changed. */
  readonly changed: () => void;
  /** Something could not be loaded; the walk goes on with what is there. */
  readonly problem: (error: unknown) => void;
  /** The server answers again, so what could not be reached comes now. */
  readonly answered?: () => void;
  /** The scene was published anew, and this revision is gone. */
  readonly outdated?: () => void;
}

export class Explorer implements NavigationSpace, Surveyed {
  readonly directory: ObjectDirectory;
  readonly residency: ResidencySet;
  private readonly index: CellIndex;
  private readonly loads: ModelLoads;
  private readonly navigation: MetCells;
  private readonly records: CellRecords;
  private readonly footings: Footings;
  private readonly outlook: Outlook;
  private readonly ahead: LookAhead;
  private readonly replanner: Replanner;
  private readonly recovery = new Recovery(() => this.retry("passing"));
  private readonly republication: Republication;
  private eye: Eye | undefined;
  private readonly holdingOf: HoldingOf = (model) => this.loads.of(model);
  private readonly cameOf: CameOf = (model, file) => this.loads.came_bytes(model, file);

  constructor(
    readonly scene: PublishedScene,
    private readonly host: ModelHost,
    budget: FrameBudget,
    options: ExplorerOptions,
    private readonly events: ExplorerEvents,
  ) {
    scene.workWithin(budget);
    this.directory = new ObjectDirectory(scene, options.uses, events.problem);
    this.index = new CellIndex(scene, events.problem);
    this.records = new CellRecords(scene, this.index);
    this.navigation = new MetCells(this.index, this.records);
    this.footings = new Footings(this.index, this.records, this);
    this.residency = new ResidencySet(options.memory_limit_bytes);
    this.loads = new ModelLoads({
      queue: scene.queue,
      tree: scene.tree,
      host,
      residency: this.residency,
      budget,
      growing: options.growing ?? growing(),
      smooth: new SmoothLods(smoothDecoding, scene.queue.isSound),
      changed: (hasGone) => {
        if (hasGone) this.replanner.now();
        else this.replanner.ask();
        events.changed();
      },
      problem: events.problem,
    });
    this.outlook = new Outlook(
      { scene, directory: this.directory, index: this.index, records: this.records },
      {
        shown: (sight) => this.show(sight),
        located: () => {
          events.changed();
          this.replanner.located();
        },
        learnt: () => this.replanner.ask(),
        changed: events.changed,
        problem: events.problem,
      },
    );
    this.ahead = new LookAhead(this.records, this.directory, this, () => this.replanner.ask());
    this.replanner = new Replanner({
      outlook: this.outlook,
      ahead: this.ahead,
      loads: this.loads,
      residency: this.residency,
      host,
      targets: options,
      size: statureIn(scene.manifest).size,
      line: scene.queue,
      problem: events.problem,
    });
    this.republication = new Republication(scene, () => events.outdated?.());
    scene.queue.watch({
      lost: () => this.recovery.lost(),
      answered: (wasSilent) => {
        events.answered?.();
        if (wasSilent) this.recovery.now();
      },
      missing: () => this.republication.suspect(),
      silent: () => this.outlook.goOnWithout(),
    });
    this.outlook.showWhole();
  }

  /** The cell that holds the eye, or the nearest one. */
  get cellId(): number | undefined {
    return this.outlook.cellId;
  }

  /** Whether the eye is inside that cell. */
  get inside(): boolean {
    return this.outlook.inside;
  }

  /**
   * Where somebody stands who comes down from somewhere: on the ground below, else in the nearest cell. Where the server takes too long to say
   * what lies below, what is known has to do.
   */
  async footing(eye: Vec3, body: Body): Promise<Footing | undefined> {
    const waiting = new AbortController();
    const found = this.footings.find(eye, body).catch(() => undefined);
    const known = pause(LANDING_MS, waiting.signal).then(() => undefined);
    const footing = await Promise.race([found, known]);
    waiting.abort();
    const nearest = this.outlook.cell;
    return footing ?? (nearest && this.footings.within(nearest, eye, body));
  }

  /** Whether a place where the eye is belongs to the world; nothing while nobody knows. */
  judge(pose: Pose): Astray | "well" | undefined {
    const { manifest } = this.scene;
    const { cell, locating } = this.outlook;
    if (isFar(manifest.bounds, pose)) return "outside";
    if (!cell || locating || this.index.isIncomplete) return undefined;
    return astray(manifest.bounds, cell, pose, statureIn(manifest).size) ?? "well";
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
    return this.replanner.refinedTo_px;
  }

  /** What can be seen, as far as it is known. */
  get visible(): readonly PlacedObject[] {
    return this.outlook.sight.objects;
  }

  /** How many objects can be seen, known or not; nothing while nobody knows what can be seen. */
  get visibleCount(): number | undefined {
    return this.outlook.scope()?.count;
  }

  /** Downloads and decodings under way. */
  get pending(): number {
    const asked = this.replanner.isAsked ? 1 : 0;
    return this.loads.pending + this.scene.queue.pending + (this.host.waiting ?? 0) + asked;
  }

  /** Whether the set of the current cell is what is shown and all of it is drawn, at least by its coarsest level. */
  get settled(): boolean {
    return this.outlook.knowsItsPlace && this.missing === 0 && !this.host.waiting;
  }

  /** Visible objects of which nothing is held yet; nothing while nobody knows what can be seen. */
  get missing(): number | undefined {
    const scope = this.outlook.scope();
    if (!scope) return undefined;
    const here = siblingsIn(scope.objects).filter(({ model }) => this.holds(model.model));
    return here.reduce((count, { objects }) => count - objects.length, scope.count);
  }

  /** Visible objects of which something is held and yet nothing is drawn: always 0, or there is a fault. */
  get holes(): number {
    const isHole = ({ model, entry }: PlacedObject) =>
      this.residency.held(model.model) && !this.host.draws(entry.object);
    return this.visible.filter(isHole).length;
  }

  /** Towards the first picture; nothing while nobody knows what can be seen. */
  progress(): Progress | undefined {
    const scope = this.outlook.scope();
    return scope && firstProgress(scope, this.holdingOf, this.cameOf);
  }

  /** Towards a picture that is as sharp as it will get from here. */
  sharpProgress(): Progress | undefined {
    const scope = this.outlook.scope();
    return scope && this.eye && sharpProgress(scope, this.holdingOf, this.eye, this.refinedTo_px, this.cameOf);
  }

  /**
   * Shares of the visible objects that are here, and that are as sharp as the eye can tell; nothing while nobody knows what can be
   * seen, or something else is in the picture.
   */
  quality(): Shares | undefined {
    const scope = this.outlook.showsCurrent ? this.outlook.scope() : undefined;
    return scope && this.eye && shares(scope, this.holdingOf, this.eye, this.refinedTo_px);
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
    this.eye = eye;
    this.replanner.observe(eye, velocity_mps);
    this.outlook.follow(eye.position);
    this.replanner.keepUp();
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
    this.replanner.ask();
    this.outlook.renew();
  }

  /** Tries again what failed. What failed for a reason that passes is tried again by itself, too. */
  retry(retried: Retried = "all"): void {
    this.loads.forgive(retried);
    this.index.forgive(retried);
    this.directory.forgive(retried);
    this.ahead.retry(retried);
    this.outlook.retry(retried);
    this.replanner.now();
    this.scene.queue.probe();
  }

  /** Follows nobody any more. Its queue is closed by whoever has made it. */
  close(): void {
    this.replanner.close();
    this.outlook.close();
    this.loads.close();
    this.recovery.close();
    this.republication.close();
    this.scene.queue.watch(undefined);
  }

  private show({ cell, objects }: Sight): void {
    this.residency.need(
      new Set(siblingsIn(objects).map(({ model }) => model.model)),
      cell === undefined ? undefined : stepsToModels(cell, this),
    );
    this.host.show(objects);
    this.replanner.now();
    this.events.changed();
  }
}
