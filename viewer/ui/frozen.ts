/** How does one look at a view from outside? What is shown stays that of one place, while one flies about and comes back. */
import { add, direction, scale, subtract, type Vec3 } from "../core/basics/geometry.ts";
import type { Mode, Pose } from "../core/movement/address.ts";
import type { Walker } from "../core/movement/walker.ts";
import type { Covered, Stage } from "../three/stage.ts";

/** One looks at it from behind and above. */
const [LOOK_BACK_M, LOOK_DOWN_M] = [12, 16];
const HEADROOM_M = 0.8;

export class FrozenView {
  /** With how one moved there. */
  readonly pose: Pose & { readonly mode: Mode };
  /** From the eye to the corners of the picture, a metre away. */
  private readonly rays: readonly Vec3[];

  /** Freezes what the walker sees, and lets it fly behind that; a panel may cover some of the picture. */
  constructor(
    private readonly walker: Walker,
    private readonly stage: Stage,
    covered?: () => Covered,
  ) {
    const { position, yaw, pitch, mode, size } = walker;
    this.pose = { position, yaw, pitch, mode };
    this.rays = stage.corners(1).map((corner) => subtract(corner, position));
    stage.lookBeside(covered);
    walker.mode = "fly";
    walker.place(add(position, add(scale(direction(yaw), -LOOK_BACK_M * size), [0, LOOK_DOWN_M * size, 0])));
    walker.look(yaw, -Math.atan2(LOOK_DOWN_M, LOOK_BACK_M));
  }

  /** Leaves out of the picture what is above the eye, such as ceilings. */
  cutAway(cut: boolean): Promise<void> {
    return this.stage.cutAbove(cut ? this.pose.position[1] + HEADROOM_M * this.walker.size : undefined);
  }

  /** Corners of the frozen picture at a distance from its eye. */
  corners(distance_m: number): Vec3[] {
    return this.rays.map((ray) => add(this.pose.position, scale(ray, distance_m)));
  }

  /** Goes back to where it was frozen; who walked there walks again, in that cell. */
  thaw(cell: number | undefined): void {
    const { position, yaw, pitch, mode } = this.pose;
    void this.cutAway(false);
    this.stage.lookBeside();
    this.walker.mode = mode;
    this.walker.place(position, mode === "walk" ? cell : undefined);
    this.walker.look(yaw, pitch);
  }
}
