/**
 * Who else is here, and which doors are closed? What the events of a session add up to. Times of the server become times
 * of this client's clock.
 */
import type { Vec3 } from "../geometry.ts";
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
  period_ms: number;
  motion: SmoothMotion | undefined;
}

/** Infos of movers out of sight are kept, as the server expects; of so many. */
const MOST_HIDDEN = 256;

export class Company {
  private readonly known = new Map<number, Known>();
  private readonly closed = new Set<number>();
  private extrapolate_ms = 2000;
  /** Adds to a time of the server to make one of this clock. */
  private ahead_ms = 0;

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
        break;
      case "appear":
        this.known.delete(event.object);
        this.known.set(event.object, { ...event, motion: this.motionOf(event.pose, now_ms) });
        this.forgetHidden();
        break;
      case "move":
        for (const { object, pose } of event.poses) this.move(object, pose, now_ms);
        break;
      case "vanish":
        for (const object of event.objects) this.hide(object);
        break;
      case "rate":
        for (const { object, period_ms } of event.periods) {
          const mover = this.known.get(object);
          if (mover) mover.period_ms = period_ms;
        }
        break;
      case "door":
        if (event.open) this.closed.delete(event.object);
        else this.closed.add(event.object);
        break;
      case "revision":
        // Its doors are other objects, and all of them are open.
        this.closed.clear();
        break;
      case "resync":
        this.known.clear();
        this.closed.clear();
        break;
    }
  }

  /** Those who can be seen, as they stand now. */
  movers(now_ms: number): Mover[] {
    return [...this.known.values()].flatMap(({ motion, ...mover }) =>
      motion ? { ...mover, ...motion.at(now_ms) } : [],
    );
  }

  private move(object: number, pose: MoverPose, now_ms: number): void {
    const mover = this.known.get(object);
    if (!mover) return;
    if (mover.motion) mover.motion.correct(this.here(pose), now_ms);
    else mover.motion = this.motionOf(pose, now_ms);
  }

  private hide(object: number): void {
    const mover = this.known.get(object);
    if (mover) mover.motion = undefined;
  }

  private forgetHidden(): void {
    const hidden = [...this.known.values()].filter(({ motion }) => !motion);
    for (const { object } of hidden.slice(0, Math.max(0, hidden.length - MOST_HIDDEN))) this.known.delete(object);
  }

  private motionOf(pose: MoverPose, now_ms: number): SmoothMotion {
    return new SmoothMotion(this.here(pose), now_ms, this.extrapolate_ms);
  }

  private here(pose: MoverPose): MoverPose {
    return { ...pose, t_ms: pose.t_ms + this.ahead_ms };
  }
}
