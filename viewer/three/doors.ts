/**
 * How does a door open? Its leaf, which is published closed, swings about one of its upright edges. The edge is the end of
 * its longer side, in the order of the axes: nothing published says where its hinges are.
 */
import { Matrix4 } from "three";
import type { Bounds } from "../core/geometry.ts";

const OPEN_RAD = 1.4;
const SWING_S = 0.7;

export class DoorSwing {
  /** 0 closed, 1 open. */
  private share: number;

  constructor(
    private readonly bounds: Bounds,
    private target: 0 | 1,
  ) {
    this.share = target;
  }

  /** Starts to open or close it; `at once` without a swing. */
  turn(open: boolean, how: "at once" | "swinging"): void {
    this.target = open ? 1 : 0;
    if (how === "at once") this.share = this.target;
  }

  /** Goes on for a frame; answers whether the leaf moved. */
  step(seconds: number): boolean {
    const left = this.target - this.share;
    if (left === 0) return false;
    const most = seconds / SWING_S;
    this.share += Math.min(most, Math.max(-most, left));
    return true;
  }

  /** What moves the leaf from where it was published to where it is, in world space. */
  matrix(): Matrix4 {
    const { min, max } = this.bounds;
    const wide = max[0] - min[0] >= max[2] - min[2];
    const [x, z] = wide ? [min[0], (min[2] + max[2]) / 2] : [(min[0] + max[0]) / 2, min[2]];
    // Slow at both ends.
    const eased = this.share * this.share * (3 - 2 * this.share);
    return new Matrix4()
      .makeTranslation(x, 0, z)
      .multiply(new Matrix4().makeRotationY(OPEN_RAD * eased))
      .multiply(new Matrix4().makeTranslation(-x, 0, -z));
  }
}
