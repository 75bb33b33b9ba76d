/** Where is the eye going? Its velocity, smoothed, so that one step aside is no turn; as in `client/src/strategy/motion.rs`. */
import { add, length, scale, subtract, type Vec3 } from "../basics/geometry.ts";

/** How quickly a new velocity is believed, as a rate per second. */
const RESPONSE_PER_S = 4;
/** Who moves faster than this was put somewhere else. */
const FASTEST_MPS = 40;
/** Who moves more slowly stands. */
const SLOWEST_MPS = 0.2;

const AT_REST: Vec3 = [0, 0, 0];

export class Motion {
  private last: { readonly t_ms: number; readonly position: Vec3 } | undefined;
  private velocity: Vec3 = AT_REST;

  /** The eye is there at this time, from any beginning. */
  observe(t_ms: number, position: Vec3): void {
    const { last } = this;
    if (last && t_ms > last.t_ms) {
      const passed_s = (t_ms - last.t_ms) / 1000;
      const now = scale(subtract(position, last.position), 1 / passed_s);
      const blend = 1 - Math.exp(-RESPONSE_PER_S * passed_s);
      const isJump = length(now) > FASTEST_MPS;
      this.velocity = isJump ? AT_REST : add(this.velocity, scale(subtract(now, this.velocity), blend));
    }
    this.last = { t_ms, position };
  }

  /** Metres a second along each axis; nothing for who stands. */
  get velocity_mps(): Vec3 {
    return length(this.velocity) < SLOWEST_MPS ? AT_REST : this.velocity;
  }
}
