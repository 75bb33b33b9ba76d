/**
 * Where may a walker go? Inside the union of the view cells: a step is swept through the current cell, goes on through a
 * portal where an adjacent cell continues, and slides along the hull where none does. In fly mode nothing holds it back.
 *
 * Positions are the eye's, in metres; yaw turns left about +Y and is 0 towards −Z, pitch is positive upwards, radians. Lengths and
 * speeds are a person's; in worlds of another scale they are all taken times its size (`stature.ts`).
 */
import {
  add,
  distanceToPolygon,
  dot,
  insidePlanes,
  length,
  type Plane,
  scale,
  subtract,
  type Vec3,
} from "../basics/geometry.ts";
import { EYE_HEIGHT_M } from "../basics/person.ts";
import type { Portal } from "../documents/cellrecord.ts";
import type { Mode } from "./address.ts";
import { PERSON, type Stature } from "./stature.ts";

/** What walking needs to know of a cell. */
export interface NavigationCell {
  readonly cell: number;
  readonly planes: readonly Plane[];
  readonly adjacent: readonly number[];
  /** Its openings, once its record has arrived. */
  readonly portals: readonly Portal[] | undefined;
}

/** The cells that are known so far. */
export interface NavigationSpace {
  cell(id: number): NavigationCell | undefined;
  /** Whether a door is closed, so that nobody gets through. */
  isShut(door: number): boolean;
  /** Whether nobody can say where a cell is: nothing holds who goes there. */
  isLost(cell: number): boolean;
}

/** What a person wants, each from −1 to 1. */
export interface Intent {
  readonly forward: number;
  readonly right: number;
  readonly up: number;
  readonly fast: boolean;
}

export const IDLE: Intent = { forward: 0, right: 0, up: 0, fast: false };

export const WALK_SPEED_MPS = 2.2;
const FAST_FACTOR = 2.5;
/** Distance that a walker keeps from walls, so that the near plane never cuts into one. */
const BODY_RADIUS_M = 0.22;
/** How fast a walker is pushed off a wall, or rises and falls to stand on the floor. */
const SETTLE_MPS = 6;
/** Gap between hulls that still counts as touching. */
const SEAM_M = 2e-3;
/** What leans more is no wall but a floor or a ceiling: a vertical part of its normal. */
const STEEP = 0.5;
/** How far from a portal's polygon one may pass. */
const PORTAL_SLACK_M = 0.05;
/** Eyes that start so high above the floor are not meant to stand on it; lower ones come down when they walk. */
const HOVER_FROM_M = 3;
/** Who comes down by less in a frame has landed. */
const LANDED_M = 1e-4;
/** Who is slower stands. */
const LEAST_MPS = 1e-3;
/** How quickly the wanted velocity is reached, as a rate per second. */
const RESPONSE_PER_S = 12;

interface Place {
  readonly position: Vec3;
  readonly cell: NavigationCell;
}

/** Sweeps a displacement through the cells, sliding along hulls. */
export function sweep(space: NavigationSpace, start: Place, displacement: Vec3, mode: "slide" | "stop"): Place {
  let { position, cell } = start;
  let remaining = displacement;
  for (let step = 0; step < 24 && length(remaining) > 1e-9; step += 1) {
    let share = 1;
    let face: Plane | undefined;
    for (const plane of cell.planes) {
      const rate = dot(plane.normal, remaining);
      if (rate <= 1e-12) continue;
      const at = Math.max(plane.offset - dot(plane.normal, position), 0) / rate;
      if (at < share) [share, face] = [at, plane];
    }
    position = add(position, scale(remaining, share));
    remaining = scale(remaining, 1 - share);
    if (!face) break;
    const beyond = continues(space, cell, position, remaining);
    if (beyond) cell = beyond;
    else if (leadsAway(space, cell, position, face)) return { position: add(position, remaining), cell };
    else if (mode === "stop") break;
    else remaining = subtract(remaining, scale(face.normal, dot(face.normal, remaining)));
  }
  return { position, cell };
}

/** The adjacent cell into which a path goes on from a point on the hull. */
function continues(
  space: NavigationSpace,
  cell: NavigationCell,
  point: Vec3,
  heading: Vec3,
): NavigationCell | undefined {
  const ahead = add(point, scale(heading, SEAM_M / Math.max(length(heading), 1e-12)));
  for (const id of cell.adjacent) {
    const next = space.cell(id);
    if (next && insidePlanes(next.planes, ahead, SEAM_M) && passes(space, cell, next, point)) return next;
  }
  return undefined;
}

/** Whether an opening in a wall leads from a point into a cell of which nobody knows where it is. */
function leadsAway(space: NavigationSpace, cell: NavigationCell, point: Vec3, face: Plane): boolean {
  const isWall = Math.abs(face.normal[1]) < STEEP;
  return isWall && opensInto(space, cell, point, (id) => space.isLost(id));
}

/** Whether an opening may lead from a point on the hull into a cell that was not met yet; without its record, a cell may open anywhere. */
function leadsOn(space: NavigationSpace, cell: NavigationCell, point: Vec3): boolean {
  const isUnmet = (id: number) => !space.cell(id);
  return cell.portals ? opensInto(space, cell, point, isUnmet) : cell.adjacent.some(isUnmet);
}

/** Whether an opening that no door closes leads from a point into one of some cells. */
function opensInto(
  space: NavigationSpace,
  cell: NavigationCell,
  point: Vec3,
  isSought: (cell: number) => boolean,
): boolean {
  const portals = cell.portals?.filter(({ to, door }) => isSought(to) && (door === undefined || !space.isShut(door)));
  return portals?.some(({ polygon }) => distanceToPolygon(polygon, point) <= PORTAL_SLACK_M) ?? false;
}

/** Whether an opening leads from one cell into another at a point; cells that overlap there need none. */
function passes(space: NavigationSpace, cell: NavigationCell, next: NavigationCell, point: Vec3): boolean {
  const all = cell.portals?.filter((portal) => portal.to === next.cell) ?? [];
  const portals = all.filter(({ door }) => door === undefined || !space.isShut(door));
  if (portals.length === 0 && all.length > 0) return false;
  if (portals.length === 0 || insidePlanes(next.planes, point, -PORTAL_SLACK_M)) return true;
  return portals.some((portal) => distanceToPolygon(portal.polygon, point) <= PORTAL_SLACK_M);
}

export class Walker {
  position: Vec3 = [0, 0, 0];
  yaw = 0;
  pitch = 0;
  mode: Mode = "walk";
  private velocity: Vec3 = [0, 0, 0];
  private cell: number | undefined;
  /** Height of the eye above the floor; `undefined` before the floor was felt, `"hover"` when it does not matter. */
  private eyeHeight_m: number | "hover" | undefined;
  /** Whether it comes down, or up, to where it stands, although it wants to go nowhere. */
  private landing = false;

  constructor(
    private readonly space: NavigationSpace,
    private readonly stature: Stature = PERSON,
  ) {}

  /** A share of a person's size. */
  get size(): number {
    return this.stature.size;
  }

  /** How fast one walks who does not hurry. */
  get walkSpeed_mps(): number {
    return WALK_SPEED_MPS * this.size;
  }

  /** The distance that is kept from walls. */
  get bodyRadius_m(): number {
    return BODY_RADIUS_M * this.size;
  }

  /** From the floor to the eye of who stands upright. */
  get standing_m(): number {
    return EYE_HEIGHT_M * this.size;
  }

  /** Metres per second, for prediction. */
  get speed(): Vec3 {
    return this.velocity;
  }

  /** Stands at once. */
  halt(): void {
    this.velocity = [0, 0, 0];
  }

  /** Puts the eye somewhere, in a cell when one is known to hold it. */
  place(position: Vec3, cell?: number): void {
    this.position = position;
    this.velocity = [0, 0, 0];
    this.eyeHeight_m = undefined;
    this.landing = false;
    this.cell = cell;
  }

  /** Comes down from somewhere in a cell until it stands on the floor. */
  land(position: Vec3, cell: number): void {
    this.place(position, cell);
    this.mode = "walk";
    this.eyeHeight_m = this.standing_m;
    this.landing = true;
  }

  /** Tells the walker in which cell it stands when it has lost its way or left the cells. */
  standIn(cell: number): void {
    const current = this.here();
    if (!current || !insidePlanes(current.planes, this.position, SEAM_M)) this.cell = cell;
  }

  look(yaw_rad: number, pitch_rad: number): void {
    const turn = 2 * Math.PI;
    this.yaw = ((((yaw_rad + Math.PI) % turn) + turn) % turn) - Math.PI;
    this.pitch = Math.min(1.5, Math.max(-1.5, pitch_rad));
  }

  /** Turns an intent into a velocity and takes a step; answers whether the eye moved. */
  step(seconds: number, intent: Intent): boolean {
    const wanted = this.wantedVelocity(intent);
    const blend = 1 - Math.exp(-RESPONSE_PER_S * seconds);
    this.velocity = add(this.velocity, scale(subtract(wanted, this.velocity), blend));
    if (length(this.velocity) < LEAST_MPS * this.size) this.velocity = [0, 0, 0];
    return this.travel(scale(this.velocity, seconds), seconds);
  }

  /** Moves the eye by a displacement as far as the mode allows; answers whether it moved. */
  travel(displacement: Vec3, seconds: number): boolean {
    const before = this.position;
    const cell = this.here();
    if (this.mode === "fly" || !cell || !insidePlanes(cell.planes, this.position, SEAM_M)) {
      this.position = add(this.position, displacement);
    } else if (length(displacement) > 0 || this.landing) {
      this.walk(cell, displacement, seconds);
    }
    const way_m = length(subtract(this.position, before));
    if (this.landing && cell && seconds > 0 && way_m < LANDED_M * this.size) this.landing = false;
    return way_m > 1e-7 * this.size;
  }

  /** Whether a straight line from the eye towards a point leads to an opening of a door; nothing hinders who is in no cell. */
  leadsTo(point: Vec3, door: number): boolean {
    const cell = this.here();
    if (this.mode === "fly" || !cell || !insidePlanes(cell.planes, this.position, SEAM_M)) return true;
    const end = sweep(this.space, { position: this.position, cell }, subtract(point, this.position), "stop");
    return end.cell.portals?.some((portal) => portal.door === door) ?? false;
  }

  private here(): NavigationCell | undefined {
    return this.cell === undefined ? undefined : this.space.cell(this.cell);
  }

  private wantedVelocity(intent: Intent): Vec3 {
    const fly = this.mode === "fly";
    const size = Math.hypot(intent.forward, intent.right, intent.up);
    if (size === 0) return [0, 0, 0];
    const plain_mps = fly ? this.stature.flight_mps : this.walkSpeed_mps;
    const speed = (plain_mps * (intent.fast ? FAST_FACTOR : 1)) / Math.max(size, 1);
    const [sin, cos] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    const level = fly ? Math.cos(this.pitch) : 1;
    const climb = fly ? Math.sin(this.pitch) * intent.forward : 0;
    const ahead = intent.forward * level;
    return [
      speed * (-sin * ahead + cos * intent.right),
      speed * (climb + intent.up),
      speed * (-cos * ahead - sin * intent.right),
    ];
  }

  private walk(from: NavigationCell, displacement: Vec3, seconds: number): void {
    if (this.eyeHeight_m === undefined) this.eyeHeight_m = this.feelFloor({ position: this.position, cell: from });
    if (displacement[1] !== 0) this.eyeHeight_m = "hover";
    let place = sweep(this.space, { position: this.position, cell: from }, displacement, "slide");
    if (!insidePlanes(place.cell.planes, place.position, SEAM_M)) {
      // Out into a cell of which nothing is known.
      this.position = place.position;
      return;
    }
    place = this.keepOffWalls(place, seconds);
    if (typeof this.eyeHeight_m === "number") place = this.standOnFloor(place, this.eyeHeight_m, seconds);
    this.position = place.position;
    this.cell = place.cell.cell;
  }

  private feelFloor(place: Place): number | "hover" {
    const height = this.heightAboveFloor(place);
    if (height > HOVER_FROM_M * this.size) return "hover";
    return Math.min(height, this.standing_m);
  }

  private heightAboveFloor(place: Place): number {
    const floor = sweep(this.space, place, [0, -100, 0], "stop");
    return place.position[1] - floor.position[1];
  }

  private standOnFloor(place: Place, eyeHeight_m: number, seconds: number): Place {
    const rise = eyeHeight_m - this.heightAboveFloor(place);
    const most = SETTLE_MPS * this.size * seconds;
    // The rest is left for the next frames, also when nobody walks then.
    if (seconds > 0 && Math.abs(rise) > most) this.landing = true;
    return sweep(this.space, place, [0, Math.min(most, Math.max(-most, rise)), 0], "stop");
  }

  /** Pushes the eye off faces behind which nothing continues. */
  private keepOffWalls(place: Place, seconds: number): Place {
    let result = place;
    const radius_m = this.bodyRadius_m;
    for (const plane of place.cell.planes) {
      if (Math.abs(plane.normal[1]) > STEEP) continue;
      const gap = plane.offset - dot(plane.normal, result.position);
      if (gap >= radius_m) continue;
      const reach = sweep(this.space, result, scale(plane.normal, radius_m), "stop");
      const open = dot(plane.normal, subtract(reach.position, result.position));
      if (open >= radius_m - Math.min(SEAM_M, radius_m / 2)) continue;
      // Who is kept out of a doorway until one knows what is behind it would never learn that: one learns it in the doorway.
      if (leadsOn(this.space, reach.cell, reach.position)) continue;
      const push = Math.min(radius_m - open, SETTLE_MPS * this.size * seconds);
      result = sweep(this.space, result, scale(plane.normal, -push), "stop");
    }
    return result;
  }
}
