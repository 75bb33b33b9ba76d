/**
 * How does a door open? Its leaf, which is published closed, swings about one of its upright edges. The edge is the end of
 * its longer side, in the order of the axes: nothing published says where its hinges are.
 */
import { Box3, Matrix4, Vector3 } from "three";
import type { Bounds } from "../core/basics/geometry.ts";

const OPEN_RAD = 1.4;
const SWING_S = 0.7;

export class DoorSwing {
  /** 0 closed, 1 open. */
  private share: number;
  /** Where the leaf was when `step` last told. */
  private told: number;

  constructor(
    /** Of the leaf where it was published, which closes the doorway. */
    readonly bounds: Bounds,
    private target: 0 | 1,
  ) {
    this.share = target;
    this.told = target;
  }

  /** Starts to open or close it; `at once` without a swing. */
  turn(open: boolean, how: "at once" | "swinging"): void {
    this.target = open ? 1 : 0;
    if (how === "at once") this.share = this.target;
  }

  /** Goes on for a frame; answers whether the leaf has moved since it was asked last. */
  step(seconds: number): boolean {
    const [left, most] = [this.target - this.share, seconds / SWING_S];
    this.share += Math.min(most, Math.max(-most, left));
    const moved = this.share !== this.told;
    this.told = this.share;
    return moved;
  }

  /** Of the leaf where it is now. */
  leaf(): Bounds {
    const { min, max } = this.bounds;
    const box = new Box3(new Vector3(...min), new Vector3(...max)).applyMatrix4(this.matrix());
    return { min: box.min.toArray(), max: box.max.toArray() };
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
