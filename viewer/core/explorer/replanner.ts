/**
 * Is what is under way just what is wanted? Looks anew (`strategy/planner.ts`) when the eye has moved, when something has come and when more
 * can be seen, as `replan` in `client/src/explorer` does, and learns in time what lies ahead.
 */
import { length, subtract, type Vec3 } from "../basics/geometry.ts";
import type { ModelHost, ModelLoads } from "../models/modelloads.ts";
import { Pacer } from "../pace/pacer.ts";
import { areSame, farObjects } from "../strategy/farobjects.ts";
import { hasFirstPicture, shrink, targetWithin } from "../strategy/plan.ts";
import { wanted } from "../strategy/planner.ts";
import type { Want } from "../strategy/priority.ts";
import type { HoldingOf } from "../strategy/progress.ts";
import { MemoryShortError, type ResidencySet } from "../strategy/residency.ts";
import type { Eye } from "../strategy/sight.ts";
import { isAllKnown } from "../strategy/visible.ts";
import type { LookAhead } from "./lookahead.ts";
import type { Outlook } from "./outlook.ts";

/** Up to which error, and how many triangles, models are refined. */
export interface Targets {
  /** Models are refined until their error covers at most so many pixels. */
  readonly target_px: number;
  /** Triangles of all that is visible; models are refined less where it would take more. Unlimited unless given. */
  readonly most_triangles?: number;
}

export interface ReplannerParts {
  readonly outlook: Outlook;
  readonly ahead: LookAhead;
  readonly loads: ModelLoads;
  readonly residency: ResidencySet;
  readonly host: ModelHost;
  readonly targets: Targets;
  /** Of who goes through it, as a share of a person's. */
  readonly size: number;
  /** How fast the line is. */
  readonly line: { readonly bytes_per_s: number };
  readonly problem: (error: unknown) => void;
}

/** Who has moved so far, or goes so much faster or elsewhere, looks anew at what is wanted. */
const [MOVED_M, CHANGED_MPS] = [0.25, 0.5];

/** Of what comes one after the other within this time, only the first is looked at by itself. */
const PAUSE_MS = 15;

export class Replanner {
  private readonly planning = new Pacer(() => this.plan(), PAUSE_MS);
  private readonly holdingOf: HoldingOf = (model) => this.parts.loads.of(model);
  private eye: Eye | undefined;
  private velocity_mps: Vec3 = [0, 0, 0];
  /** The eye and its velocity as it was last looked at what is wanted; nothing before the first look. */
  private planned: { readonly eye: Eye; readonly velocity_mps: Vec3 } | undefined;
  private target_px: number;
  /** What is drawn by impostors. */
  private far: ReadonlySet<number> = new Set();
  /** The cell of which it was said that memory does not suffice for it. */
  private shortIn: number | undefined;
  /** Whether the eye was, or may have been, in another cell when it was last planned: one needs to know what is there before anything gets finer here. */
  private isElsewhere = false;
  /** Whether something of all in sight that can be had was there once. */
  private hasBegun = false;
  private closed = false;

  constructor(private readonly parts: ReplannerParts) {
    this.target_px = parts.targets.target_px;
  }

  /** Models are refined until their error covers so many pixels, as far as there are triangles for it. */
  get refinedTo_px(): number {
    return this.target_px;
  }

  /** Whether it is to be planned anew. */
  get isAsked(): boolean {
    return this.planning.isAsked;
  }

  /** Is told of the eye, for the next plan. */
  observe(eye: Eye, velocity_mps: Vec3): void {
    this.eye = eye;
    this.velocity_mps = velocity_mps;
  }

  /** Plans anew where the last plan was for somewhere else. */
  keepUp(): void {
    if (!this.isPlanned) this.now();
  }

  /** Plans anew, once for all who ask one after the other. */
  ask(): void {
    this.planning.ask();
  }

  /** Plans anew at once. */
  now(): void {
    this.planning.now();
  }

  /** Plans anew when one knows again where the eye is. */
  located(): void {
    if (this.isElsewhere && !this.parts.outlook.locating) this.ask();
  }

  close(): void {
    this.closed = true;
    this.planning.close();
  }

  /** Whether what is wanted from near by was looked at. */
  private get isPlanned(): boolean {
    const { eye, planned, velocity_mps } = this;
    const { size } = this.parts;
    if (!eye || !planned) return false;
    const isSame = eye.height_px === planned.eye.height_px && eye.viewAngle_rad === planned.eye.viewAngle_rad;
    const isNear = length(subtract(eye.position, planned.eye.position)) < MOVED_M * size;
    return isSame && isNear && length(subtract(velocity_mps, planned.velocity_mps)) < CHANGED_MPS * size;
  }

  /**
   * Makes what is under way equal to what is wanted. What lies ahead is read of once all is asked for that is missing here, and
   * fetched once the first picture was there.
   */
  private plan(): void {
    const { eye, velocity_mps } = this;
    const { outlook, ahead, loads, targets, size, line } = this.parts;
    if (!eye || this.closed) return;
    this.planned = { eye, velocity_mps };
    const { cellId, sight } = outlook;
    const { most_triangles } = targets;
    this.target_px = targets.target_px;
    if (most_triangles !== undefined) {
      this.target_px = targetWithin(sight.objects, eye, this.target_px, most_triangles);
    }
    const { bytes_per_s } = line;
    this.isElsewhere = !outlook.knowsItsPlace;
    const isComplete = isAllKnown(sight) && !this.isElsewhere;
    this.hasBegun ||= isComplete && hasFirstPicture(sight.objects, loads);
    const looksAhead = cellId !== undefined && cellId === sight.cell;
    if (looksAhead) ahead.look(cellId, eye.position, velocity_mps);
    const known = looksAhead && this.hasBegun ? ahead.known : [];
    const wants = wanted(
      { eye, here: sight.objects, isAllKnown: isComplete, ahead: known },
      loads,
      this.target_px,
      bytes_per_s,
    );
    // What is on its way to save memory is not begun anew while that is short.
    const wasShort = loads.short;
    const smaller = wasShort ? this.smaller() : undefined;
    loads.follow(smaller && loads.isComing(smaller.object.model.model) ? [smaller, ...wants] : wants);
    if (loads.short) this.makeDo(wants, wasShort ? smaller : this.smaller());
    // What is missing here was asked for by now, and goes first.
    if (looksAhead && outlook.hasSurveyed && isComplete && !loads.short) ahead.learn(bytes_per_s);
    if (length(velocity_mps) > CHANGED_MPS * size) outlook.walked.open();
    this.drawFar(eye);
  }

  /** Memory does not hold what is visible: draws something more coarsely, or says that even that does not help. */
  private makeDo(wants: readonly Want[], smaller: Want | undefined): void {
    const { loads, outlook, residency, problem } = this.parts;
    if (smaller) loads.follow([smaller, ...wants]);
    if (loads.pending > 0 || this.shortIn === outlook.sight.cell) return;
    this.shortIn = outlook.sight.cell;
    problem(new MemoryShortError(residency.limit_bytes));
  }

  private smaller(): Want | undefined {
    const { outlook, residency } = this.parts;
    return shrink(outlook.sight.objects, (model) => {
      const grade = residency.base(model)?.grade;
      return grade && { grade, bytes: residency.baseAlone_bytes(model) };
    });
  }

  /** Chooses what is drawn by impostors. */
  private drawFar(eye: Eye): void {
    const { outlook, host } = this.parts;
    const far = farObjects(outlook.sight.objects, this.holdingOf, eye, this.target_px, this.far);
    if (areSame(far, this.far)) return;
    this.far = far;
    host.drawFar(far);
  }
}
