/**
 * Need one say where one is? Only when the others, who extrapolate the last pose, would be wrong by more than they would
 * notice; and not at all while nobody may look, as long as one keeps to the promised ball.
 */
import { length, subtract, type Vec3 } from "../basics/geometry.ts";
import type { Hush } from "./events.ts";
import { extrapolate, type MoverPose, type Quaternion, turned_rad } from "./motion.ts";

const WRONG_M = 0.04;
const WRONG_RAD = 0.06;
const SHORTEST_PERIOD_MS = 80;
/** Others stop extrapolating after this time. */
const LONGEST_MS = 2000;

export class Speaker {
  private said: MoverPose | undefined;
  private hush: Hush | undefined;
  /** What was said last may not have been heard; it is not said again before. */
  private silentUntil_ms = 0;

  /** The pose to send now, or `undefined` when there is nothing to say. */
  speak(now_ms: number, position: Vec3, orientation: Quaternion, velocity: Vec3): MoverPose | undefined {
    if (now_ms < this.silentUntil_ms || this.isHushed(now_ms, position)) return undefined;
    const { said } = this;
    if (said) {
      if (now_ms - said.t_ms < SHORTEST_PERIOD_MS) return undefined;
      const wrong_m = length(subtract(position, extrapolate(said, now_ms, LONGEST_MS)));
      if (wrong_m < WRONG_M && turned_rad(orientation, said.orientation) < WRONG_RAD) return undefined;
    }
    this.said = { t_ms: Math.round(now_ms), position, orientation, velocity, acceleration: [0, 0, 0] };
    return this.said;
  }

  /** The pose to send before nothing is said for a while, standing still; `undefined` when just that was said. */
  rest(now_ms: number, position: Vec3, orientation: Quaternion): MoverPose | undefined {
    const { said } = this;
    if (now_ms < this.silentUntil_ms) return undefined;
    if (said && length(said.velocity) === 0 && length(subtract(position, said.position)) < WRONG_M) return undefined;
    this.said = { t_ms: Math.round(now_ms), position, orientation, velocity: [0, 0, 0], acceleration: [0, 0, 0] };
    return this.said;
  }

  /** Nobody may look from now on; `undefined` when somebody may. */
  keepQuiet(hush: Hush | undefined): void {
    this.hush = hush;
    // Who is looked at again must be found where it is.
    if (!hush) this.said = undefined;
  }

  /** What was said last was not heard: it is said again, but not before then. */
  pause(until_ms: number): void {
    this.silentUntil_ms = until_ms;
    this.said = undefined;
  }

  private isHushed(now_ms: number, position: Vec3): boolean {
    const { hush } = this;
    if (!hush) return false;
    const kept = now_ms < hush.until_ms && length(subtract(position, hush.center)) < hush.radius_m;
    if (!kept) this.keepQuiet(undefined);
    return kept;
  }
}
