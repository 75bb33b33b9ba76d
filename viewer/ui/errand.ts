/** How does code walk, rather than a person? In a straight line towards a point, until one is there or gets no further. */
import { length, scale, subtract, type Vec3 } from "../core/basics/geometry.ts";
import { IDLE, type Walker } from "../core/movement/walker.ts";

interface Errand {
  readonly target: Vec3;
  readonly speed_mps: number;
  readonly done: (arrived: boolean) => void;
  stuck_s: number;
}

/** A walk that gets nowhere for so long has ended. */
const STUCK_AFTER_S = 0.7;
const ARRIVED_M = 0.02;

export class Errands {
  private errand: Errand | undefined;

  constructor(private readonly walker: Walker) {}

  /** Sets out, as far as walls allow; answers whether it arrived. Height counts only when flying. */
  begin(target: Vec3, speed_mps: number): Promise<boolean> {
    this.end();
    return new Promise((done) => {
      this.errand = { target, speed_mps, done, stuck_s: 0 };
    });
  }

  /** Takes a step and answers whether the eye moved; `undefined` for who is on no errand. */
  step(seconds: number): boolean | undefined {
    return this.errand && this.run(this.errand, seconds);
  }

  /** Stops where it is. */
  end(): void {
    this.finish(false);
  }

  private run(errand: Errand, seconds: number): boolean {
    const before = this.walker.position;
    const way = subtract(errand.target, before);
    const flat: Vec3 = this.walker.mode === "fly" ? way : [way[0], 0, way[2]];
    const left_m = length(flat);
    const arrived_m = ARRIVED_M * this.walker.size;
    if (left_m > arrived_m) {
      const step_m = Math.min(left_m, errand.speed_mps * seconds);
      this.walker.travel(scale(flat, step_m / left_m), seconds);
    }
    const after = this.walker.position;
    const gained_m = left_m - Math.hypot(errand.target[0] - after[0], errand.target[2] - after[2]);
    errand.stuck_s = gained_m > 0.1 * errand.speed_mps * seconds ? 0 : errand.stuck_s + seconds;
    if (left_m <= arrived_m) this.finish(true);
    else if (errand.stuck_s > STUCK_AFTER_S) this.finish(false);
    return length(subtract(after, before)) > 1e-7;
  }

  private finish(arrived: boolean): void {
    const errand = this.errand;
    this.errand = undefined;
    if (!errand) return;
    this.walker.step(0, IDLE);
    errand.done(arrived);
  }
}
