/**
 * Where is a mover between its poses? Dead reckoning, as in NPSNET (Schmalstieg, The Remote Rendering Pipeline, 1997,
 * §3.4): it goes on as its last pose says. When the next one contradicts, what is drawn does not jump: the difference
 * fades away.
 */
import { add, length, scale, subtract, type Vec3 } from "../basics/geometry.ts";

export type Quaternion = readonly [number, number, number, number];

export interface MoverPose {
  /** In the clock of whoever said so. */
  readonly t_ms: number;
  readonly position: Vec3;
  readonly orientation: Quaternion;
  readonly velocity: Vec3;
  readonly acceleration: Vec3;
}

/** How long it takes until a difference has become half as large. */
const FADE_HALF_LIFE_MS = 90;
/** A difference that is larger is no error but a jump. */
const JUMP_M = 4;

/** p + v·t + a·t²/2, for at most `longest_ms`. */
export function extrapolate(
  { t_ms, position, velocity, acceleration }: MoverPose,
  now_ms: number,
  longest_ms: number,
): Vec3 {
  const t_s = Math.min(Math.max(now_ms - t_ms, 0), longest_ms) / 1000;
  return add(position, add(scale(velocity, t_s), scale(acceleration, (t_s * t_s) / 2)));
}

/** The angle between two orientations in radians. */
export function turned_rad(a: Quaternion, b: Quaternion): number {
  const dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  return 2 * Math.acos(Math.min(1, Math.abs(dot)));
}

/** What is drawn of one mover. */
export class SmoothMotion {
  private offset: Vec3 = [0, 0, 0];
  private turnedFrom: Quaternion;
  private corrected_ms: number;

  constructor(
    private pose: MoverPose,
    now_ms: number,
    private readonly longest_ms: number,
  ) {
    this.turnedFrom = pose.orientation;
    this.corrected_ms = now_ms;
  }

  /** Takes in a newer pose; older ones are ignored. */
  correct(pose: MoverPose, now_ms: number): void {
    if (pose.t_ms < this.pose.t_ms) return;
    const before = this.at(now_ms);
    this.pose = pose;
    this.corrected_ms = now_ms;
    const offset = subtract(before.position, extrapolate(pose, now_ms, this.longest_ms));
    this.offset = length(offset) > JUMP_M ? [0, 0, 0] : offset;
    this.turnedFrom = before.orientation;
  }

  at(now_ms: number): { position: Vec3; orientation: Quaternion } {
    const left = 0.5 ** (Math.max(0, now_ms - this.corrected_ms) / FADE_HALF_LIFE_MS);
    return {
      position: add(extrapolate(this.pose, now_ms, this.longest_ms), scale(this.offset, left)),
      orientation: between(this.pose.orientation, this.turnedFrom, left),
    };
  }
}

/** From one orientation towards another, the short way. */
function between(a: Quaternion, b: Quaternion, share: number): Quaternion {
  const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
  const mix = (i: 0 | 1 | 2 | 3) => a[i] * (1 - share) + sign * b[i] * share;
  const mixed = [mix(0), mix(1), mix(2), mix(3)] as const;
  const size = Math.hypot(...mixed);
  return size > 1e-9 ? [mixed[0] / size, mixed[1] / size, mixed[2] / size, mixed[3] / size] : a;
}
