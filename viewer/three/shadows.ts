/** What of the shadows of the sun is to be done in a frame? Ties together whether they are drawn here, when, and how. */
import type { DirectionalLight, Object3D, WebGLRenderer } from "three";
import type { Vec3 } from "../core/basics/geometry.ts";
import { DARKNESS } from "./daylight.ts";
import { type Casting, ShadowMap } from "./shadowmap.ts";
import { ShadowTurns } from "./shadowturns.ts";
import type { ShadowUse } from "./shadowuse.ts";

/** Of the time between frames shadows take this share, and so long at most, once something has begun. */
const [SHARE, MOST_MS] = [0.1, 30];

/** From where one looks. */
export interface Look {
  readonly eye: Vec3;
  /** How far the world reaches from corner to corner. */
  readonly across_m: number;
  /** How far away the nearest thing is. */
  readonly clearance_m: number;
}

export class Shadows {
  private readonly map: ShadowMap;
  private readonly turns: ShadowTurns;
  private isUsed = true;
  private isLeftOut = false;
  private lastFrame_ms = 0;

  constructor(
    renderer: WebGLRenderer,
    sun: DirectionalLight,
    private readonly use: ShadowUse,
  ) {
    this.map = new ShadowMap(renderer, sun);
    this.turns = new ShadowTurns(sun.position);
  }

  /** One of each that draws them, to be prepared. */
  sample(): Object3D {
    return this.map.casters.sample();
  }

  /** What casts them has changed. */
  changed(): void {
    this.turns.changed();
  }

  /**
   * Draws some of them, if there is anything to draw; answers whether those in the picture are others now. What casts stays turned to the sun
   * until it is turned to the eye again, which is to be done before each picture.
   */
  draw(now_ms: number, { eye, ...world }: Look, casting: Iterable<Casting>): boolean {
    const frame_ms = now_ms - this.lastFrame_ms;
    this.lastFrame_ms = now_ms;
    if (!this.isUsed || this.isLeftOut) return false;
    if (!this.map.isBusy) {
      const extent = this.turns.due(now_ms, eye, world);
      if (!extent) return false;
      this.map.begin(extent, casting);
    }
    this.map.step(Math.min(SHARE * frame_ms, MOST_MS), DARKNESS);
    return !this.map.isBusy;
  }

  /** Takes in with which share of the full width and height a moving picture is drawn. */
  after(scale: number): void {
    if (!this.isUsed) return;
    this.isUsed = this.use.after(scale);
    if (!this.isUsed) this.map.dispose();
  }

  /** Leaves them out for a while, as where a roof that casts one is not drawn. */
  leaveOut(isLeftOut: boolean): void {
    if (isLeftOut === this.isLeftOut) return;
    this.isLeftOut = isLeftOut;
    this.map.stop();
    this.turns.changed();
  }

  /** Begins again, with a graphics card that has lost all. */
  renew(): void {
    this.map.stop();
    this.turns.changed();
  }

  dispose(): void {
    this.map.dispose();
  }
}
