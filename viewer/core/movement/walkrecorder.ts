/**
 * Which way did somebody go? Takes down poses as JSON lines that `belvedere walk --script` reads: milliseconds from the
 * beginning, the eye in the space and the metres of the published world, and where it looks as a quaternion.
 *
 * At most ten poses a second, and none while nothing moves, but for the last, and the one in which a rest ended: between
 * poses a visitor walks straight, so without that it would set out too early. Who is stopped within the first tenth of a
 * second, or of one after a rest, has two poses nonetheless: where that began and where it ended.
 */
import type { Vec3 } from "../basics/geometry.ts";
import { orientationOf, type Pose } from "./address.ts";

const EVERY_MS = 100;

interface Taken {
  readonly t_ms: number;
  readonly position: Vec3;
  readonly orientation: readonly [number, number, number, number];
}

export class WalkRecorder {
  private readonly poses: Taken[] = [];
  private began_ms: number | undefined;
  private now: Taken | undefined;

  /** How long it has been going on. */
  get length_ms(): number {
    return this.now?.t_ms ?? 0;
  }

  /** The eye is there now; to be called at the beginning and in every frame. A frame that began before that counts as then. */
  observe(now_ms: number, pose: Pose): void {
    this.began_ms ??= now_ms;
    const before = this.now;
    const taken = takenAt(Math.max(0, Math.round(now_ms - this.began_ms)), pose);
    const last = this.poses.at(-1);
    if (!last) this.poses.push(taken);
    else if (taken.t_ms >= last.t_ms + EVERY_MS && !isSame(taken, last)) {
      const hasRested = before && before.t_ms >= last.t_ms + EVERY_MS && isSame(before, last);
      this.poses.push(hasRested ? before : taken);
    }
    this.now = taken;
  }

  /** All of it as JSON lines, up to where the eye was last. */
  script(): string {
    const { now, poses } = this;
    const last = poses.at(-1);
    const all = last && now && now.t_ms > last.t_ms ? [...poses, now] : poses;
    const [rest, before, end] = all.slice(-3);
    // Rather than more than ten in a second, the last but one is left out, unless a rest ended in it.
    const isCrowded = rest && before && end && end.t_ms - before.t_ms < EVERY_MS && !isSame(rest, before);
    const kept = isCrowded ? [...all.slice(0, -2), end] : all;
    return kept.map((pose) => `${JSON.stringify(pose)}\n`).join("");
  }
}

/** Tenths of a millimetre, and angles to match. */
function takenAt(t_ms: number, { position, yaw, pitch }: Pose): Taken {
  const round = (x: number) => Math.round(x * 1e4) / 1e4;
  const [x, y, z] = position;
  const [i, j, k, w] = orientationOf(yaw, pitch);
  return { t_ms, position: [round(x), round(y), round(z)], orientation: [round(i), round(j), round(k), round(w)] };
}

function isSame(a: Taken, b: Taken): boolean {
  const isEqual = (one: readonly number[], other: readonly number[]) => one.every((x, i) => x === other[i]);
  return isEqual(a.position, b.position) && isEqual(a.orientation, b.orientation);
}
