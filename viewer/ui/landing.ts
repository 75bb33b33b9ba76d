/** How does one who flies come down? When it is known where, unless one goes elsewhere, or on flying, meanwhile. */
import type { Explorer } from "../core/explorer/explorer.ts";
import type { Footing } from "../core/movement/footing.ts";
import type { Walker } from "../core/movement/walker.ts";

export class Landing {
  /** Tells one from the next, while it is not known where that will be. */
  private awaited: object | undefined;

  /** `landed` is told when one stands. */
  constructor(
    private readonly explorer: Explorer,
    private readonly walker: Walker,
    private readonly landed: () => void,
  ) {}

  /** Whether one is about to come down. */
  get isAwaited(): boolean {
    return this.awaited !== undefined;
  }

  callOff(): void {
    this.awaited = undefined;
  }

  /** Comes down onto the ground below, else into the nearest cell. */
  async comeDown(): Promise<void> {
    const landing = {};
    this.awaited = landing;
    const footing = await this.explorer.footing(this.walker.position, this.walker);
    if (this.awaited === landing) this.land(footing);
  }

  land(footing: Footing | undefined): void {
    this.awaited = undefined;
    if (footing) this.walker.land(footing.position, footing.cell);
    this.landed();
  }
}
