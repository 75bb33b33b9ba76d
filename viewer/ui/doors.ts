/**
 * How do doors move? Each that is met hangs in the doorway that it closes, and swings when it opens or closes: for oneself alone,
 * unless somebody says which are closed for all.
 */
import { type DoorPlace, doorInReach } from "../core/movement/reach.ts";
import { DoorSwing } from "../three/doors.ts";
import type { Visit } from "./visit.ts";

export class Doors {
  private readonly swings = new Map<number, DoorSwing>();
  private closed: ReadonlySet<number> = new Set();
  private readonly calm = matchMedia("(prefers-reduced-motion: reduce)");

  constructor(private readonly visit: Visit) {
    visit.onFrame((_now_ms, seconds) => this.frame(seconds));
  }

  /** Those that were met, and where they stand. */
  *places(): Iterable<DoorPlace> {
    for (const [door, swing] of this.swings) yield { door, doorway: swing.bounds, leaf: swing.leaf() };
  }

  /** The door that one would use from here. */
  inReach(): number | undefined {
    const { walker } = this.visit;
    return doorInReach(this.places(), walker, (point, door) => walker.leadsTo(point, door), walker.size);
  }

  /** Opens one that is closed, and the reverse. */
  use(door: number): void {
    const closed = new Set(this.closed);
    if (!closed.delete(door)) closed.add(door);
    this.shutExactly(closed);
  }

  /** These are closed, and all others open. */
  shutExactly(closed: ReadonlySet<number>): void {
    this.closed = closed;
    this.visit.explorer.shutExactly(closed);
    const how = this.calm.matches ? "at once" : "swinging";
    for (const [door, swing] of this.swings) swing.turn(!closed.has(door), how);
  }

  /** Hangs doors that were not met before, and moves those that swing. Answers whether any has moved. */
  private frame(seconds: number): boolean {
    const { explorer } = this.visit;
    let moved = false;
    for (const door of explorer.doors) {
      const placed = this.swings.has(door) ? undefined : explorer.placed(door);
      if (!placed) continue;
      const swing = new DoorSwing(placed.entry.bounds, explorer.isShut(door) ? 0 : 1);
      this.swings.set(door, swing);
      this.visit.move(door, swing.matrix());
    }
    for (const [door, swing] of this.swings) {
      if (!swing.step(seconds)) continue;
      this.visit.move(door, swing.matrix());
      moved = true;
    }
    return moved;
  }
}
