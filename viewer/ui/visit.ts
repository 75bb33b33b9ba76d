/**
 * What happens from frame to frame? One visit to one scene: moves the walker, tells the explorer where the eye is
 * and draws when something has changed.
 */
import type { Uses } from "../core/atlas/objects.ts";
import type { PublishedScene } from "../core/atlas/published.ts";
import { add, type Bounds, direction, scale, type Vec3 } from "../core/basics/geometry.ts";
import type { FileRef, Viewpoint } from "../core/documents/documents.ts";
import type { PlacedObject } from "../core/documents/placedobject.ts";
import { Explorer } from "../core/explorer/explorer.ts";
import { anglesOf, isPoseBroken, type Mode, type Pose, readPose } from "../core/movement/address.ts";
import type { Astray } from "../core/movement/astray.ts";
import { madeUp } from "../core/movement/overview.ts";
import { statureIn } from "../core/movement/stature.ts";
import { Walker } from "../core/movement/walker.ts";
import { FrameBudget } from "../core/pace/framebudget.ts";
import { FrameTimes } from "../core/pace/frametimes.ts";
import { Motion } from "../core/strategy/motion.ts";
import { PRIORITY } from "../core/strategy/priority.ts";
import type { QualityHistory } from "../core/strategy/quality.ts";
import type { Eye } from "../core/strategy/sight.ts";
import { ThreeModelHost } from "../three/modelhost.ts";
import { Overlay } from "../three/overlay.ts";
import type { Covered, Matrix4, Object3D, Painting, Stage } from "../three/stage.ts";
import { Arrival } from "./arrival.ts";
import type { Controls } from "./controls.ts";
import { Errands } from "./errand.ts";
import { Frames } from "./frames.ts";
import { FrozenView } from "./frozen.ts";
import { Landing } from "./landing.ts";
import { Picture } from "./picture.ts";
import { type Display, Reporter } from "./readings.ts";

export interface VisitParts {
  readonly scene: PublishedScene;
  readonly stage: Stage;
  readonly display: Display;
  readonly uses?: Uses;
  /** Whether a roof would be all that one sees from high up; not unless said. */
  readonly isRoofed?: boolean;
  /** What belongs into a picture of all of it; all that there is unless said. */
  readonly frame?: Bounds;
  /** Told of the pose every now and then while it changes, for the address of a page. */
  readonly posed?: (pose: Pose) => void;
  readonly problem: (error: unknown) => void;
  /** As in `ExplorerEvents`. */
  readonly answered?: () => void;
  readonly outdated?: () => void;
  /** Told that a link leads out of the world, or where nobody can stand. */
  readonly astray?: (how: Astray) => void;
  /** Told when the graphics card is lost to the page, and when it is here again. */
  readonly graphics?: (state: "lost" | "here") => void;
}

/** Does what is done in every frame; answers whether the picture has changed. */
export type FrameListener = (now_ms: number, seconds: number) => boolean;

/** Phones announce little memory, and die from using too much; nor do they draw as many triangles in a frame. */
const [MEMORY_LIMIT_BYTES, MOST_TRIANGLES] = matchMedia("(pointer: coarse)").matches ? [350e6, 1.5e6] : [1200e6, 8e6];
/** Models are refined until they are off by at most so much. */
const TARGET_PX = 1.5;
const WORK_FRAMES = 600;
/** Decoding begins nothing more in a frame after so long. */
const DECODE_MS_PER_FRAME = 1.5;
/** Nor are more objects placed whose models are here; the latter after a frame that took very long. */
const [PLACE_MS_PER_FRAME, PLACE_MOST_MS] = [1, 8];
const LONGEST_STEP_S = 0.25;

const AT_REST: Vec3 = [0, 0, 0];

export class Visit {
  readonly explorer: Explorer;
  readonly walker: Walker;
  private readonly host = new ThreeModelHost(
    () => {
      this.redraw();
      this.parts.stage.recast();
    },
    (root) => this.prepare(root),
  );
  /** What the inspector draws into the picture. */
  readonly overlay = new Overlay(
    (root) => this.prepare(root),
    () => this.redraw(),
  );
  /** What a frame takes besides drawing and decoding: walking, choosing what to fetch, and people. */
  readonly work = new FrameTimes(WORK_FRAMES);
  private readonly budget = new FrameBudget(DECODE_MS_PER_FRAME, () => performance.now());
  private readonly listeners: FrameListener[] = [];
  private readonly resting: (() => void)[] = [];
  private readonly ending = new AbortController();
  private controls: Controls | undefined;
  private readonly frames = new Frames((now_ms) => this.controls !== undefined && this.frame(now_ms, this.controls));
  private closed = false;
  private moved = true;
  private lastFrame_ms: number | undefined;
  private readonly motion = new Motion();
  private readonly errands: Errands;
  private readonly reporter: Reporter;
  private readonly picture: Picture;
  private readonly arrival: Arrival;
  private readonly landing: Landing;
  private frozenView: FrozenView | undefined;

  constructor(private readonly parts: VisitParts) {
    const { scene, stage, display, posed, problem, answered, outdated, graphics, uses = {} } = parts;
    this.reporter = new Reporter(display, posed);
    this.explorer = new Explorer(
      scene,
      this.host,
      this.budget,
      { memory_limit_bytes: MEMORY_LIMIT_BYTES, target_px: TARGET_PX, most_triangles: MOST_TRIANGLES, uses },
      {
        changed: () => {
          this.reporter.changed();
          this.frames.wake();
        },
        problem,
        ...(answered && { answered }),
        ...(outdated && { outdated }),
      },
    );
    this.walker = new Walker(this.explorer, statureIn(scene.manifest));
    this.errands = new Errands(this.walker);
    const { explorer, walker, host } = this;
    this.picture = new Picture({ stage, host, walker, explorer, bounds: scene.manifest.bounds });
    this.arrival = new Arrival(parts, this.walker);
    this.landing = new Landing(this.explorer, this.walker, () => this.setMode("walk"));
    stage.add(this.host.root);
    stage.add(this.overlay.root);
    stage.fit(scene.manifest.bounds);
    stage.onLost(() => {
      // Who leaves gives it back, too.
      if (!this.closed) graphics?.("lost");
    });
    stage.onRestored(() => {
      graphics?.("here");
      this.redraw();
    });
    display.title(scene.manifest.title);
    const turned = () => document.hidden && this.rest();
    document.addEventListener("visibilitychange", turned, { signal: this.ending.signal });
  }

  /** Lets frames run; `controls` say what the person wants in each. */
  begin(controls: Controls): void {
    this.controls = controls;
    this.onRest(() => controls.letGo());
    this.frames.wake();
  }

  /** Says whether anybody may see it; while nobody may, there are frames only while something happens. */
  watch(isWatched: boolean): void {
    this.frames.watch(isWatched);
  }

  /** Calls back when one stands still because no frame is drawn any more: for who looks at another page. */
  onRest(listener: () => void): void {
    this.resting.push(listener);
  }

  /** No frame ends a walk now, nor says that it has ended. */
  private rest(): void {
    this.walker.halt();
    for (const listener of this.resting) listener();
  }

  /** Ends it, and frees what it took. */
  close(): void {
    this.closed = true;
    this.frames.close();
    this.controls?.close();
    this.ending.abort();
    this.errands.end();
    this.landing.callOff();
    this.explorer.close();
    this.host.clear();
    this.overlay.clear();
    this.parts.stage.close();
  }

  /** Puts the eye somewhere at once. */
  teleport({ position, yaw, pitch, mode }: Pose): void {
    this.errands.end();
    this.landing.callOff();
    this.walker.place(position);
    this.walker.look(yaw, pitch);
    if (mode && mode !== this.walker.mode && !this.frozen) this.setMode(mode);
    this.moves();
    // At once, so that nobody is told of the old place as of this one before the next frame.
    if (!this.frozen) this.explorer.follow(this.eye, AT_REST);
  }

  goTo({ position, orientation }: Viewpoint, mode?: Mode): void {
    this.teleport({ position, ...anglesOf(orientation), mode });
  }

  /** Goes to the place of a link, and says so when that leads nowhere. */
  follow(link: Pose): void {
    this.teleport(link);
    this.arrival.comeBy(link);
  }

  /** The same for its hash, which may be broken; answers whether it names a place. */
  followLink(hash: string): boolean {
    const pose = readPose(hash);
    if (pose) this.follow(pose);
    else if (isPoseBroken(hash)) this.parts.astray?.("unreadable");
    return pose !== undefined;
  }

  turn(yaw: number, pitch: number): void {
    this.walker.look(this.walker.yaw + yaw, this.walker.pitch + pitch);
    this.moves();
  }

  /** Looks straight ahead. */
  level(): void {
    this.turn(0, -this.walker.pitch);
  }

  /** Begins where the author says; where nobody does, high up with all of it in view, as far as it is open above; below a roof where the bake would. */
  start(): void {
    const [first] = this.parts.scene.manifest.viewpoints;
    const high = this.arrival.beginHigh();
    if (high) this.teleport({ ...high, mode: "fly" });
    else if (first) this.goTo(first, "walk");
  }

  /** What of the world belongs into a picture of all of it. */
  get framed(): Bounds {
    return this.arrival.framed;
  }

  /**
   * Flies, or comes down to walk: onto the ground below, else into the nearest cell. Who has only looked from high up comes down where
   * a bake would begin, in a large cell with a floor.
   */
  toggleFly(): void {
    const { walker } = this;
    const place = madeUp(this.parts.scene.manifest);
    if (this.frozen) return;
    if (walker.mode === "walk") this.setMode("fly");
    else if (this.landing.isAwaited) this.landing.callOff();
    else if (place && this.arrival.hasOnlyLooked) {
      this.goTo(place);
      this.level();
      this.landing.land({ position: place.position, cell: place.cell });
    } else void this.landing.comeDown();
  }

  private setMode(mode: Mode): void {
    this.walker.mode = mode;
    this.moves();
    this.parts.display.mode(mode);
  }

  /** Whether what is shown stays that of one place, while one flies about. */
  get frozen(): boolean {
    return this.frozenView !== undefined;
  }

  /** From now on nothing follows the eye any more, and no wall holds it. A panel may cover some of the picture. */
  freeze(covered?: () => Covered): void {
    this.errands.end();
    this.landing.callOff();
    this.frozenView = new FrozenView(this.walker, this.parts.stage, covered);
    // One may have come here since the last frame.
    this.reporter.moved();
    this.moves();
    this.parts.display.mode("frozen");
  }

  /** While the view is frozen: leaves out of the picture what is above the eye, such as ceilings. */
  async cutAway(cut: boolean): Promise<void> {
    await this.frozenView?.cutAway(cut);
    this.redraw();
  }

  /** Goes back to where the view was frozen. */
  thaw(): void {
    if (!this.frozenView) return;
    this.errands.end();
    this.frozenView.thaw(this.explorer.cellId);
    this.frozenView = undefined;
    this.moves();
    this.redraw();
    this.parts.display.mode(this.walker.mode);
  }

  /** Where one stands: while the view is frozen there, wherever one flies about. */
  get standpoint(): Pose {
    return this.frozenView?.pose ?? this.walker;
  }

  /** Adds something to the picture. */
  add(object: Object3D): void {
    this.parts.stage.add(object);
  }

  /** Waits until what is below a node can be drawn without waiting. */
  prepare(root: Object3D): Promise<void> {
    return this.parts.stage.prepare(root);
  }

  /** Has pictures drawn. */
  paint(painting: Painting): void {
    this.parts.stage.paint(painting);
  }

  /** How good the picture was over time. */
  get quality(): QualityHistory {
    return this.reporter.quality;
  }

  /** What the last picture took. */
  get drawn(): { drawCalls: number; triangles: number } {
    const { drawCalls, triangles } = this.parts.stage;
    return { drawCalls, triangles };
  }

  /** The picture as it is, which stays when the visit is over. */
  copy(): HTMLCanvasElement {
    return this.picture.copy();
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
    return this.frozenView?.corners(distance_m) ?? [];
  }

  /** The object at a point of the canvas. */
  pick(x: number, y: number): PlacedObject | undefined {
    return this.picture.pick(x, y);
  }

  /** Where on the canvas a visible object can be clicked; looks at a grid of points. */
  find(sourceNode: string): { x: number; y: number } | undefined {
    return this.picture.find(sourceNode);
  }

  /** Asks for a new picture. */
  redraw(): void {
    // What comes with the manifest is shown before there is a picture, which begins as if it were asked for.
    this.picture?.ask();
    this.frames.wake();
  }

  /** One stands or looks otherwise, or what is shown follows something else. */
  private moves(): void {
    this.moved = true;
    this.frames.wake();
  }

  /** Walks in a straight line, as far as walls allow; answers whether it arrived. Height counts only when flying. */
  walkTo(target: Vec3, speed_mps: number): Promise<boolean> {
    this.frames.wake();
    return this.errands.begin(target, speed_mps);
  }

  /** Answers whether anything happens: the picture has changed, or something of it is still to come. */
  private frame(now_ms: number, controls: Controls): boolean {
    const frame_ms = now_ms - (this.lastFrame_ms ?? now_ms);
    const seconds = Math.min(LONGEST_STEP_S, frame_ms / 1000);
    this.lastFrame_ms = now_ms;
    const streamed_ms = this.budget.taken_ms;
    this.host.place(Math.min(PLACE_MOST_MS, PLACE_MS_PER_FRAME * this.budget.beginFrame(frame_ms)));
    // Before the eye is followed: what the index knows already it has answered since the last frame.
    this.reporter.report(now_ms, this.explorer, this.standpoint);
    const started_ms = performance.now();
    controls.turnByKeys(seconds);
    if (!this.frozen && this.explorer.inside && this.explorer.cellId !== undefined)
      this.walker.standIn(this.explorer.cellId);
    const walked = this.errands.step(seconds) ?? this.walker.step(seconds, controls.intent());
    for (const listener of this.listeners) if (listener(now_ms, seconds)) this.picture.ask();
    const walked_ms = performance.now() - started_ms;
    const resized = this.picture.resize(now_ms, walked || this.moved);
    const resized_ms = performance.now();
    if (walked || resized || this.moved) {
      this.picture.aim();
      if (this.frozen) this.reporter.changed();
      else this.reporter.moved();
      this.moved = false;
    }
    if (!this.frozen) {
      this.motion.observe(now_ms, this.walker.position);
      // Before that follows the eye: what the index knows already it has answered since the last frame.
      this.arrival.judge(this.explorer);
      this.explorer.follow(this.eye, this.motion.velocity_mps);
    }
    this.work.add(walked_ms + performance.now() - resized_ms);
    const draws = this.picture.draw(now_ms, Math.max(0, frame_ms - streamed_ms), this.frozen);
    return draws || this.explorer.pending > 0;
  }

  /** A point some metres ahead of the eye, at its height. */
  ahead(forward_m: number): Vec3 {
    const { yaw, position } = this.walker;
    return add(position, scale(direction(yaw), forward_m));
  }
}
