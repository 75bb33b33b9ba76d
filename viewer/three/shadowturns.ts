/**
 * When is the shadow map drawn anew, and around which place? When the eye has gone some way from the middle of what is drawn, or what is
 * drawn has changed; never more than a few times a second. The place is rounded to texels of the widest tile, so that what
 * is drawn anew falls on the same texels as before, and no edge swims.
 */
import { Matrix4, Vector3 } from "three";
import type { Vec3 } from "../core/basics/geometry.ts";
import { TILE_GROWTH, TILE_PX, TILES } from "./shading.ts";

/** The widest tile reaches so far to each side of the eye; less in small worlds, twice or more times as much where all is far away. */
const REACH_M = 192;
/** Times as far as a small world is long, and as the nearest thing is away. */
const [REACH_OF_WORLD, REACH_OF_CLEARANCE] = [1.5, 3];
/** The eye may go so far from the middle, in halves of the finest tile. */
const LEASH = 0.2;
/** No sooner than so long after the last time. */
const EVERY_MS = 350;

/** What a shadow map shows: a place, and how far to each side of it. */
export interface Extent {
  readonly centre: Vector3;
  readonly reach_m: number;
}

export class ShadowTurns {
  private hasChanged = true;
  private last: { readonly eye: Vector3; readonly extent: Extent; readonly at_ms: number } | undefined;

  /** `sun` is the direction in which it stands. */
  constructor(private readonly sun: Vector3) {}

  /** What is drawn has changed. */
  changed(): void {
    this.hasChanged = true;
  }

  /** What is to be drawn at last, if anything is; to be asked when nothing is being drawn. */
  due(
    now_ms: number,
    eye: Vec3,
    { across_m, clearance_m }: { across_m: number; clearance_m: number },
  ): Extent | undefined {
    const { last } = this;
    if (last && now_ms < last.at_ms + EVERY_MS) return undefined;
    const at = new Vector3(...eye);
    const reach_m = reachFor(across_m, clearance_m);
    const finest_m = reach_m / TILE_GROWTH ** (TILES - 1);
    const stays = last?.extent.reach_m === reach_m && last.eye.distanceTo(at) < LEASH * finest_m;
    if (stays && !this.hasChanged) return undefined;
    const extent = { centre: onTexels(at, this.sun, (2 * reach_m) / TILE_PX), reach_m };
    this.last = { eye: at, extent, at_ms: now_ms };
    this.hasChanged = false;
    return extent;
  }
}

/** How far the widest tile reaches: by halves and doubles, so that it seldom changes. */
function reachFor(across_m: number, clearance_m: number): number {
  const least_m = Math.max(Math.min(REACH_OF_WORLD * across_m, REACH_M), REACH_OF_CLEARANCE * clearance_m);
  return least_m > 0 ? REACH_M * 2 ** Math.ceil(Math.log2(least_m / REACH_M)) : REACH_M;
}

/** Axes of a picture that the sun sees: to the right, upwards, and towards the sun. */
export function sunFromWorld(sun: Vector3): Matrix4 {
  return new Matrix4().lookAt(sun, new Vector3(), new Vector3(0, 1, 0)).transpose();
}

/** The place next to this one that is a whole number of texels away from the world's origin. */
function onTexels(place: Vector3, sun: Vector3, texel_m: number): Vector3 {
  const fromWorld = sunFromWorld(sun);
  const { x, y, z } = place.clone().applyMatrix4(fromWorld);
  const rounded = [x, y, z].map((along) => Math.round(along / texel_m) * texel_m) as [number, number, number];
  return new Vector3(...rounded).applyMatrix4(fromWorld.transpose());
}
