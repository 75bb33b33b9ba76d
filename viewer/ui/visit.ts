/**
 * What happens from frame to frame? One visit to one scene: moves the walker, tells the explorer where the eye is, draws
 * when something has changed and keeps the HUD and the page's address up to date.
 */
import { anglesOf, type Pose } from "../core/address.ts";
import type { FileRef, Viewpoint } from "../core/documents.ts";
import { Explorer } from "../core/explorer.ts";
import { FrameBudget } from "../core/framebudget.ts";
import { FrameTimes } from "../core/frametimes.ts";
import { add, direction, length, scale, subtract, type Vec3 } from "../core/geometry.ts";
import { Motion } from "../core/motion.ts";
import type { PlacedObject, Uses } from "../core/objects.ts";
import { madeUp, overview } from "../core/overview.ts";
import { PRIORITY } from "../core/priority.ts";
import type { Progress } from "../core/progress.ts";
import type { PublishedScene } from "../core/published.ts";
import { QualityHistory } from "../core/quality.ts";
import type { Eye } from "../core/screenerror.ts";
import { statureIn } from "../core/stature.ts";
import { IDLE, Walker } from "../core/walker.ts";
import { ThreeModelHost } from "../three/modelhost.ts";
import { Overlay } from "../three/overlay.ts";
import type { Matrix4, Object3D, Stage } from "../three/stage.ts";
import type { Controls } from "./controls.ts";

/** What a person is told about a visit. */
export interface Readings {
  readonly cell: number | undefined;
  /** Whether the eye is in that cell; else it is the nearest. */
  readonly inside: boolean;
  readonly visible: number;
  readonly objects: number;
  readonly fetched_bytes: number;
  readonly whole_bytes: number | undefined;
  /** Of this cell; nothing while nobody knows what can be seen from it. */
  readonly progress: Progress | undefined;
  readonly settled: boolean;
}

/** How one gets about; what is frozen is flown around in. */
export type Moving = "fly" | "walk" | "frozen";

/** What tells it. */
export interface Display {
  title(text: string): void;
  mode(mode: Moving): void;
  show(readings: Readings): void;
}

export interface VisitParts {
  readonly scene: PublishedScene;
  readonly stage: Stage;
  readonly display: Display;
  readonly uses?: Uses;
  /** Told of the pose every now and then while it changes, for the address of a page. */
  readonly posed?: (pose: Pose) => void;
  readonly problem: (error: unknown) => void;
}

/** Does what is done in every frame; answers whether the picture has changed. */
export type FrameListener = (now_ms: number, seconds: number) => boolean;

/** Phones announce little memory, and die from using too much; nor do they draw as many triangles in a frame. */
const [MEMORY_LIMIT_BYTES, MOST_TRIANGLES] = matchMedia("(pointer: coarse)").matches ? [350e6, 1.5e6] : [1200e6, 8e6];
/** Models are refined until they are off by at most so much. */
const TARGET_PX = 1.5;
const [QUALITY_EVERY_MS, QUALITY_SPAN_MS] = [250, 60_000];
const WORK_FRAMES = 600;
const DECODE_MS_PER_FRAME = 8;
const HUD_EVERY_MS = 100;
const ADDRESS_EVERY_MS = 500;
/** A picture at rest for so long is drawn once more with all its pixels. */
const STILL_AFTER_MS = 350;
/** One looks at a frozen view from behind and above. */
const [LOOK_BACK_M, LOOK_DOWN_M] = [12, 16];
const FIND_EVERY_PX = 12;
const HEADROOM_M = 0.8;
const LONGEST_STEP_S = 0.25;

/** A walk that was asked for by code rather than by a person. */
interface Errand {
  readonly target: Vec3;
  readonly speed_mps: number;
  readonly done: (arrived: boolean) => void;
  stuck_s: number;
}

/** A walk that gets nowhere for so long has ended. */
const STUCK_AFTER_S = 0.7;
const ARRIVED_M = 0.02;
const AT_REST: Vec3 = [0, 0, 0];

export class Visit {
  readonly explorer: Explorer;
  readonly walker: Walker;
  private readonly host = new ThreeModelHost(() => {
    this.dirty = true;
  });
  /** What the inspector draws into the picture. */
  readonly overlay = new Overlay();
  readonly quality = new QualityHistory(QUALITY_EVERY_MS, QUALITY_SPAN_MS);
  /** What a frame takes besides drawing and decoding: walking, choosing what to fetch, and people. */
  readonly work = new FrameTimes(WORK_FRAMES);
  private readonly budget = new FrameBudget(DECODE_MS_PER_FRAME, () => performance.now());
  private readonly listeners: FrameListener[] = [];
  private closed = false;
  private dirty = true;
  private drewLastFrame = false;
  private lastMotion_ms = 0;
  private hudStale = true;
  private moved = true;
  private hudShown_ms = 0;
  private addressWritten_ms = 0;
  private addressStale = false;
  private lastFrame_ms: number | undefined;
  private readonly motion = new Motion();
  private errand: Errand | undefined;
  /** Where one has begun high up, if so. */
  private looksDownFrom: Vec3 | undefined;
  private pinned:
    | { readonly pose: Pose; readonly mode: Walker["mode"]; readonly corners: (m: number) => Vec3[] }
    | undefined;

  constructor(private readonly parts: VisitParts) {
    const { scene, stage, problem, uses = {} } = parts;
    this.explorer = new Explorer(
      scene,
      this.host,
      this.budget,
      { memory_limit_bytes: MEMORY_LIMIT_BYTES, target_px: TARGET_PX, most_triangles: MOST_TRIANGLES, uses },
      {
        changed: () => {
          this.hudStale = true;
        },
        problem,
      },
    );
    this.walker = new Walker(this.explorer, statureIn(scene.manifest));
    stage.add(this.host.root);
    stage.add(this.overlay.root);
    stage.fit(scene.manifest.bounds);
    parts.display.title(scene.manifest.title);
  }

  /** Lets frames run; `controls` say what the person wants in each. */
  begin(controls: Controls): void {
    requestAnimationFrame((now_ms) => this.frame(now_ms, controls));
  }

  /** Ends it, and frees what it took. */
  close(): void {
    this.closed = true;
    this.endErrand(false);
    this.explorer.close();
    this.host.clear();
    this.overlay.clear();
    this.parts.stage.close();
  }

  /** Puts the eye somewhere at once. */
  teleport({ position, yaw, pitch }: Pose): void {
    this.endErrand(false);
    this.walker.place(position);
    this.walker.look(yaw, pitch);
    this.moved = true;
    // At once, so that nobody is told of the old place as of this one before the next frame.
    if (!this.frozen) this.explorer.follow(this.eye, AT_REST);
  }

  goTo(viewpoint: Viewpoint): void {
    this.teleport({ position: viewpoint.position, ...anglesOf(viewpoint.orientation) });
  }

  turn(yaw: number, pitch: number): void {
    this.walker.look(this.walker.yaw + yaw, this.walker.pitch + pitch);
    this.moved = true;
  }

  /** Looks straight ahead. */
  level(): void {
    this.turn(0, -this.walker.pitch);
  }

  /** Begins where the author says; where nobody does, high up with all of it in view, as far as it is open above. */
  start(): void {
    const { scene, stage, display } = this.parts;
    const [first] = scene.manifest.viewpoints;
    const { width, height } = stage.size;
    const high = overview(scene.manifest, stage.eye([0, 0, 0]).viewAngle_rad, width / Math.max(1, height));
    if (high) {
      this.teleport(high);
      this.walker.mode = "fly";
      this.looksDownFrom = high.position;
      display.mode("fly");
    } else if (first) this.goTo(first);
  }

  /** Whether one has not flown away from where one has begun high up. */
  private get hasOnlyLooked(): boolean {
    const { walker, looksDownFrom } = this;
    return looksDownFrom !== undefined && length(subtract(walker.position, looksDownFrom)) < walker.bodyRadius_m;
  }

  /**
   * Flies, or comes down to walk: onto the floor of the cell that is nearest. Who has only looked from high up comes down where a bake
   * would begin, in a large cell with a floor.
   */
  toggleFly(): void {
    const { walker, explorer } = this;
    const place = madeUp(this.parts.scene.manifest);
    if (this.frozen) return;
    if (walker.mode === "walk") walker.mode = "fly";
    else if (place && this.hasOnlyLooked) {
      this.goTo(place);
      this.level();
      walker.land(place.position, place.cell);
    } else {
      const { cellId } = explorer;
      const footing = explorer.footing(walker.position, walker.bodyRadius_m);
      if (footing && cellId !== undefined) walker.land(footing, cellId);
      else walker.mode = "walk";
    }
    this.moved = true;
    this.parts.display.mode(walker.mode);
  }

  /** Whether what is shown stays that of one place, while one flies about. */
  get frozen(): boolean {
    return this.pinned !== undefined;
  }

  /** From now on nothing follows the eye any more, and no wall holds it. */
  freeze(): void {
    this.endErrand(false);
    const { position, yaw, pitch, mode } = this.walker;
    const unit = this.parts.stage.corners(1);
    const corners = (distance_m: number) =>
      unit.map((corner) => add(position, scale(subtract(corner, position), distance_m)));
    this.pinned = { pose: { position, yaw, pitch }, mode, corners };
    this.walker.mode = "fly";
    this.walker.place(add(this.ahead(-LOOK_BACK_M * this.walker.size), [0, LOOK_DOWN_M * this.walker.size, 0]));
    this.walker.look(yaw, -Math.atan2(LOOK_DOWN_M, LOOK_BACK_M));
    this.moved = true;
    this.parts.display.mode("frozen");
  }

  /** While the view is frozen: leaves out of the picture what is above the eye, such as ceilings. */
  cutAway(cut: boolean): void {
    this.parts.stage.cutAbove(
      cut && this.pinned ? this.pinned.pose.position[1] + HEADROOM_M * this.walker.size : undefined,
    );
    this.dirty = true;
  }

  /** Goes back to where the view was frozen. */
  thaw(): void {
    if (!this.pinned) return;
    const { pose, mode } = this.pinned;
    this.pinned = undefined;
    this.walker.mode = mode;
    this.cutAway(false);
    this.teleport(pose);
    if (mode === "walk") this.walker.place(pose.position, this.explorer.cellId);
    this.parts.display.mode(mode);
  }

  /** Where the view was frozen. */
  get frozenPose(): Pose | undefined {
    return this.pinned?.pose;
  }

  /** Adds something to the picture. */
  add(object: Object3D): void {
    this.parts.stage.add(object);
  }

  /** Lets something draw pictures of its own. */
  paint(work: Parameters<Stage["paint"]>[0]): void {
    this.parts.stage.paint(work);
  }

  /** What the last picture took. */
  get drawn(): { drawCalls: number; triangles: number } {
    const { drawCalls, triangles } = this.parts.stage;
    return { drawCalls, triangles };
  }

  /** Brings a published file, after all that can be seen stands there. */
  fetch({ url, bytes }: FileRef): Promise<ArrayBuffer> {
    const { queue, tree } = this.parts.scene;
    return queue.request(tree.resolve(url), PRIORITY.finer, { bytes, reason: "worn by somebody in sight" });
  }

  /** The eye that the picture is drawn for. */
  get eye(): Eye {
    return this.parts.stage.eye(this.walker.position);
  }

  /** Moves an object from where it was published. */
  move(object: number, motion: Matrix4): void {
    this.host.move(object, motion);
  }

  /** Calls back before each frame; who answers `true` has changed the picture. */
  onFrame(listener: FrameListener): void {
    this.listeners.push(listener);
  }

  /** Corners of the frozen picture at a distance from its eye. */
  frozenCorners(distance_m: number): Vec3[] {
    return this.pinned?.corners(distance_m) ?? [];
  }

  /** The object at a point of the canvas. */
  pick(x: number, y: number): PlacedObject | undefined {
    return this.host.pick(this.parts.stage.ray(x, y), this.parts.stage.cutHeight_m);
  }

  /** Where on the canvas a visible object can be clicked; looks at a grid of points. */
  find(sourceNode: string): { x: number; y: number } | undefined {
    const { width, height } = this.parts.stage.size;
    for (let y = FIND_EVERY_PX; y < height; y += FIND_EVERY_PX) {
      for (let x = FIND_EVERY_PX; x < width; x += FIND_EVERY_PX) {
        if (this.pick(x, y)?.entry.sourceNode === sourceNode) return { x, y };
      }
    }
    return undefined;
  }

  /** Asks for a new picture. */
  redraw(): void {
    this.dirty = true;
  }

  /** Walks in a straight line, as far as walls allow; answers whether it arrived. Height counts only when flying. */
  walkTo(target: Vec3, speed_mps: number): Promise<boolean> {
    this.endErrand(false);
    return new Promise((done) => {
      this.errand = { target, speed_mps, done, stuck_s: 0 };
    });
  }

  private frame(now_ms: number, controls: Controls): void {
    if (this.closed) {
      controls.close();
      return;
    }
    requestAnimationFrame((next_ms) => this.frame(next_ms, controls));
    const frame_ms = now_ms - (this.lastFrame_ms ?? now_ms);
    const seconds = Math.min(LONGEST_STEP_S, frame_ms / 1000);
    this.lastFrame_ms = now_ms;
    this.budget.beginFrame(frame_ms);
    // Before the eye is followed: what the index knows already it has answered since the last frame.
    this.report(now_ms);
    const started_ms = performance.now();
    const { stage } = this.parts;
    controls.turnByKeys(seconds);
    if (!this.frozen && this.explorer.inside && this.explorer.cellId !== undefined)
      this.walker.standIn(this.explorer.cellId);
    const walked = this.errand ? this.runErrand(this.errand, seconds) : this.walker.step(seconds, controls.intent());
    for (const listener of this.listeners) if (listener(now_ms, seconds)) this.dirty = true;
    if (walked || this.moved || this.dirty) this.lastMotion_ms = now_ms;
    const moving = now_ms - this.lastMotion_ms < STILL_AFTER_MS;
    const walked_ms = performance.now() - started_ms;
    const resized = stage.resize(moving ? "moving" : "still");
    const resized_ms = performance.now();
    if (walked || resized || this.moved) {
      stage.aim(this.walker.position, this.walker.yaw, this.walker.pitch);
      if (!this.frozen) this.addressStale = true;
      this.hudStale = true;
      this.dirty = true;
      this.moved = false;
    }
    if (!this.frozen) {
      this.motion.observe(now_ms, this.walker.position);
      this.explorer.follow(this.eye, this.motion.velocity_mps);
    }
    this.work.add(walked_ms + performance.now() - resized_ms);
    if (this.dirty) this.host.look(this.walker.position);
    if (this.dirty) stage.render(this.drewLastFrame && moving ? frame_ms : undefined);
    this.drewLastFrame = this.dirty && moving;
    this.dirty = false;
  }

  private runErrand(errand: Errand, seconds: number): boolean {
    const before = this.walker.position;
    const way = subtract(errand.target, before);
    const flat: Vec3 = this.walker.mode === "fly" ? way : [way[0], 0, way[2]];
    const left_m = length(flat);
    const arrived_m = ARRIVED_M * this.walker.size;
    if (left_m > arrived_m) {
      const step_m = Math.min(left_m, errand.speed_mps * seconds);
      this.walker.travel(scale(flat, step_m / left_m), seconds);
    }
    const after = this.walker.position;
    const gained_m = left_m - Math.hypot(errand.target[0] - after[0], errand.target[2] - after[2]);
    errand.stuck_s = gained_m > 0.1 * errand.speed_mps * seconds ? 0 : errand.stuck_s + seconds;
    if (left_m <= arrived_m) this.endErrand(true);
    else if (errand.stuck_s > STUCK_AFTER_S) this.endErrand(false);
    return length(subtract(after, before)) > 1e-7;
  }

  private endErrand(arrived: boolean): void {
    const errand = this.errand;
    this.errand = undefined;
    if (!errand) return;
    this.walker.step(0, IDLE);
    errand.done(arrived);
  }

  private report(now_ms: number): void {
    const { explorer, walker } = this;
    this.quality.sample(now_ms, () => explorer.quality());
    if (this.hudStale || explorer.pending > 0) {
      if (now_ms - this.hudShown_ms >= HUD_EVERY_MS) {
        this.hudShown_ms = now_ms;
        this.hudStale = false;
        this.showHud();
      }
    }
    if (this.addressStale && now_ms - this.addressWritten_ms >= ADDRESS_EVERY_MS) {
      this.addressWritten_ms = now_ms;
      this.addressStale = false;
      this.parts.posed?.(walker);
    }
  }

  private showHud(): void {
    const { explorer } = this;
    const { scene, display } = this.parts;
    const { bytes } = scene.pointer;
    display.show({
      cell: explorer.cellId,
      inside: explorer.inside,
      visible: explorer.visibleCount,
      objects: scene.manifest.counts.objects,
      fetched_bytes: scene.queue.tally.bytes,
      whole_bytes: bytes.get("published") ?? bytes.get("level0"),
      settled: explorer.settled,
      progress: explorer.progress(),
    });
  }

  /** A point some metres ahead of the eye, at its height. */
  ahead(forward_m: number): Vec3 {
    const { yaw, position } = this.walker;
    return add(position, scale(direction(yaw), forward_m));
  }
}
