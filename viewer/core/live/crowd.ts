/**
 * How does a crowd walk? Each of its people is shown at the moment of a round of two steps that fits the way that they have
 * gone, so that no foot slides, and each wears a colour of their own. Far ones are drawn by pictures, near ones are not.
 */
import type { Vec3 } from "../basics/geometry.ts";
import { type Eye, screenError_px } from "../strategy/sight.ts";
import type { Quaternion } from "./motion.ts";

/** Two moments, and how much of the second is in what is shown. */
export interface Pose {
  readonly from: number;
  readonly to: number;
  readonly share: number;
}

/** A round of two steps. */
export interface Round {
  /** Moments of it, evenly apart in the way that they take. */
  readonly frames: number;
  /** The way of all of it. */
  readonly stride_m: number;
  /** The moment that shows who stands still. */
  readonly standing: number;
}

/** Who is slower than this stands; slower people would seem to be frozen in a step. */
const SLOWEST_MPS = 0.12;
/** How long it takes until a walker stands. */
const SETTLE_MS = 220;
/** Who gets so far in one picture has not walked. */
const JUMP_M = 3;
/** Pictures stay until their error is so many times what will do. */
const STAYS = 1.25;

/** The steps of one person. */
export class Gait {
  private before: { readonly position: Vec3; readonly now_ms: number } | undefined;
  private way_m = 0;
  private walked_ms = Number.NEGATIVE_INFINITY;

  constructor(private readonly round: Round) {}

  /** Where the person is now, who looks along −z of the orientation; answers what to show. */
  step(position: Vec3, orientation: Quaternion, now_ms: number): Pose {
    const before = this.before ?? { position, now_ms };
    this.before = { position, now_ms };
    const [dx, dz] = [position[0] - before.position[0], position[2] - before.position[2]];
    const way_m = Math.hypot(dx, dz);
    if (way_m < JUMP_M && way_m > (SLOWEST_MPS * (now_ms - before.now_ms)) / 1000) {
      if (now_ms - this.walked_ms > SETTLE_MS) this.way_m = 0;
      this.way_m += isBackwards(dx, dz, orientation) ? -way_m : way_m;
      this.walked_ms = now_ms;
    }
    return this.pose(now_ms - this.walked_ms);
  }

  private pose(still_ms: number): Pose {
    const { frames, stride_m, standing } = this.round;
    if (still_ms >= SETTLE_MS) return { from: standing, to: standing, share: 0 };
    const rounds = this.way_m / stride_m;
    const at = (rounds - Math.floor(rounds)) * frames;
    const from = Math.floor(at) % frames;
    const to = (from + 1) % frames;
    if (still_ms === 0) return { from, to, share: at - Math.floor(at) };
    return { from: at - Math.floor(at) < 0.5 ? from : to, to: standing, share: still_ms / SETTLE_MS };
  }
}

/** The moment that comes nearest: pictures show no others. */
export function nearestFrame({ from, to, share }: Pose): number {
  return share < 0.5 ? from : to;
}

/** Whether somebody is so far away that pictures whose pixels are so large will do; `was` says whether they did before. */
export function isFar(distance_m: number, pixel_m: number, eye: Eye, target_px: number, was: boolean): boolean {
  return screenError_px(pixel_m, distance_m, eye) <= target_px * (was ? STAYS : 1);
}

/** The colour that a mover wears: ids next to each other have unlike ones. */
export function colourOf(object: number): { hue: number; saturation: number; lightness: number } {
  const part = (step: number) => (object * step) % 1;
  // Golden angle, and the steps of the most even sequence in the plane.
  return {
    hue: part(0.381966),
    saturation: 0.25 + 0.45 * part(0.7548776662466927),
    lightness: 0.3 + 0.35 * part(0.5698402909980532),
  };
}

/** Whether a way leads to where −z of an orientation does not. */
function isBackwards(dx: number, dz: number, [x, y, z, w]: Quaternion): boolean {
  const [aheadX, aheadZ] = [-2 * (x * z + w * y), -(1 - 2 * (x * x + y * y))];
  return dx * aheadX + dz * aheadZ < -0.3 * Math.hypot(dx, dz);
}
