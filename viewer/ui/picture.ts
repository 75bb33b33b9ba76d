/** When is a new picture drawn, with how many pixels, and what is at a point of it? */
import { type Bounds, diagonal_m, distanceToBounds } from "../core/basics/geometry.ts";
import type { PlacedObject } from "../core/documents/placedobject.ts";
import type { Explorer } from "../core/explorer/explorer.ts";
import { clearance_m } from "../core/movement/clearance.ts";
import type { Walker } from "../core/movement/walker.ts";
import type { ThreeModelHost } from "../three/modelhost.ts";
import type { Stage } from "../three/stage.ts";

/** A picture at rest for so long is drawn once more with all its pixels. */
const STILL_AFTER_MS = 350;
const FIND_EVERY_PX = 12;

export interface PictureParts {
  readonly stage: Stage;
  readonly host: ThreeModelHost;
  readonly walker: Walker;
  readonly explorer: Explorer;
  /** Of the world. */
  readonly bounds: Bounds;
}

export class Picture {
  private isAsked = true;
  private isMoving = false;
  private drewLastFrame = false;
  private lastMotion_ms = 0;

  constructor(private readonly parts: PictureParts) {}

  /** Asks for a new one. */
  ask(): void {
    this.isAsked = true;
  }

  /** Gives it as many pixels as it may have now, where the eye has moved or not; answers whether it had others. */
  resize(now_ms: number, hasMoved: boolean): boolean {
    if (hasMoved || this.isAsked) this.lastMotion_ms = now_ms;
    this.isMoving = now_ms - this.lastMotion_ms < STILL_AFTER_MS;
    return this.parts.stage.resize(this.isMoving ? "moving" : "still");
  }

  /** Looks from where one is. */
  aim(): void {
    const { position, yaw, pitch } = this.parts.walker;
    this.parts.stage.aim(position, yaw, pitch);
    this.isAsked = true;
  }

  /** Draws a new one where that was asked for, or shadows have changed; answers whether. Drawing may be what a frame took for so long. */
  draw(now_ms: number, frame_ms: number, isFrozen: boolean): boolean {
    const { stage, host, walker } = this.parts;
    if (this.isAsked) this.reach(isFrozen);
    const draws = stage.cast(now_ms, host.casting()) || this.isAsked;
    this.isAsked = false;
    if (draws) host.look(walker.position, stage.view);
    // Fewer pixels would not have what streaming takes end sooner.
    if (draws) stage.render(this.drewLastFrame && this.isMoving ? frame_ms : undefined);
    this.drewLastFrame = draws && this.isMoving;
    return draws;
  }

  /** As it is, which stays when the visit is over. */
  copy(): HTMLCanvasElement {
    const { stage, host, walker } = this.parts;
    host.look(walker.position, stage.view);
    return stage.copy();
  }

  /** The object at a point of the canvas. */
  pick(x: number, y: number): PlacedObject | undefined {
    const { stage, host } = this.parts;
    return host.pick(stage.ray(x, y), stage.cutHeight_m);
  }

  /** Where on the canvas a visible object can be clicked; looks at a grid of points. */
  find(sourceNode: string): { x: number; y: number } | undefined {
    const { width, height } = this.parts.stage.size;
    for (let y = FIND_EVERY_PX; y < height; y += FIND_EVERY_PX) {
      for (let x = FIND_EVERY_PX; x < width; x += FIND_EVERY_PX) {
        if (this.pick(x, y)?.entry.sourceNode === sourceNode) return { x, y };
      }
    }
    return undefined;
  }

  /** Has drawn what is as near as what can be seen, and as far as all of the world. */
  private reach(isFrozen: boolean): void {
    const { stage, explorer, walker, bounds } = this.parts;
    const { position } = walker;
    // Who looks at a frozen view from outside may have before them what cannot be seen from there.
    const nearest_m = isFrozen ? 0 : clearance_m(explorer.visible, position, stage.nearAt_m);
    stage.reach(Number.isFinite(nearest_m) ? nearest_m : 0, distanceToBounds(bounds, position) + diagonal_m(bounds));
  }
}
