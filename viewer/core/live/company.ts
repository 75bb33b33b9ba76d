/**
 * Who else is here, and which doors are closed? What the events of a session add up to. Times of the server become times
 * of this client's clock.
 */
import type { Vec3 } from "../basics/geometry.ts";
import type { LiveEvent, Worn } from "./events.ts";
import { type MoverPose, type Quaternion, SmoothMotion } from "./motion.ts";

export interface Mover {
  readonly object: number;
  readonly name: string;
  readonly radius_m: number;
  /** Shortest time between what is told of it. */
  readonly period_ms: number;
  /** The model that it wears, if that has pictures. */
  readonly worn: Worn | undefined;
  readonly position: Vec3;
  readonly orientation: Quaternion;
}

interface Known {
  readonly object: number;
  readonly name: string;
  readonly radius_m: number;
  readonly worn: Worn | undefined;
  readonly period_ms: number;
}

interface Seen {
  known: Known;
  readonly motion: SmoothMotion;
}

/** Infos of hidden movers are kept, as the server expects; of so many. */
const MOST_HIDDEN = 256;

export class Company {
  private readonly seen = new Map<number, Seen>();
  /** The longest hidden first. */
  private readonly hidden = new Map<number, Known>();
  private readonly closed = new Set<number>();
  /** The revision that the session is about; events say it. */
  private told: string;
  private extrapolate_ms = 2000;
  /** Adds to a time of the server to make one of this clock, as what came quickest says; a device that sleeps may stop its own. */
  private ahead_ms = 0;

  /** `revision` is the one that is walked through; doors of another one are other objects. */
  constructor(private readonly revision: string) {
    this.told = revision;
  }

  /** Whether the session is about the revision that is walked through, so that its doors are those that one sees. */
  get isCurrent(): boolean {
    return this.told === this.revision;
  }

  /** Doors that are closed. */
  get closedDoors(): ReadonlySet<number> {
    return this.closed;
  }

  /** Takes an event in; `now_ms` is this client's clock. */
  take(event: LiveEvent, now_ms: number): void {
    switch (event.kind) {
      case "hello":
        this.ahead_ms = now_ms - event.now_ms;
        this.extrapolate_ms = event.extrapolate_ms;
        this.follow(event.revision);
        break;
      case "appear":
        this.hears(event.pose, now_ms);
        this.hidden.delete(event.object);
        this.seen.set(event.object, { known: event, motion: this.motionOf(event.pose, now_ms) });
        break;
      case "move":
        for (const { pose } of event.poses) this.hears(pose, now_ms);
        for (const { object, pose } of event.poses) this.move(object, pose, now_ms);
        break;
      case "vanish":
        for (const object of event.objects) this.vanish(object, event.mayReturn);
        break;
      case "rate":
        for (const { object, period_ms } of event.periods) {
          const mover = this.seen.get(object);
          if (mover) mover.known = { ...mover.known, period_ms };
        }
        break;
      case "door":
        if (event.open) this.closed.delete(event.object);
        else if (this.isCurrent) this.closed.add(event.object);
        break;
      case "revision":
        this.follow(event.revision);
        break;
      case "silence":
        // Who was seen may be anywhere by now; doors stay until somebody knows better.
        this.seen.clear();
        this.hidden.clear();
        break;
      case "resync":
        this.seen.clear();
        this.hidden.clear();
        this.closed.clear();
        break;
    }
  }

  /** Those who can be seen, as they stand now. */
  movers(now_ms: number): Mover[] {
    return [...this.seen.values()].map(({ known, motion }) => ({ ...known, ...motion.at(now_ms) }));
  }

  /** Doors of another revision are other objects, and all of them are open. */
  private follow(revision: string): void {
    if (revision !== this.told) this.closed.clear();
    this.told = revision;
  }

  /** Nothing is heard of before it was so. */
  private hears({ t_ms }: MoverPose, now_ms: number): void {
    this.ahead_ms = Math.min(this.ahead_ms, now_ms - t_ms);
  }

  private move(object: number, pose: MoverPose, now_ms: number): void {
    const seen = this.seen.get(object);
    const known = this.hidden.get(object);
    if (seen) seen.motion.correct(this.here(pose), now_ms);
    else if (known) {
      this.hidden.delete(object);
      this.seen.set(object, { known, motion: this.motionOf(pose, now_ms) });
    }
  }

  private vanish(object: number, mayReturn: boolean): void {
    const known = this.seen.get(object)?.known ?? this.hidden.get(object);
    this.seen.delete(object);
    this.hidden.delete(object);
    if (!known || !mayReturn) return;
    this.hidden.set(object, known);
    const [longest] = this.hidden.keys();
    if (longest !== undefined && this.hidden.size > MOST_HIDDEN) this.hidden.delete(longest);
  }

  private motionOf(pose: MoverPose, now_ms: number): SmoothMotion {
    return new SmoothMotion(this.here(pose), now_ms, this.extrapolate_ms);
  }

  private here(pose: MoverPose): MoverPose {
    return { ...pose, t_ms: pose.t_ms + this.ahead_ms };
  }
}
