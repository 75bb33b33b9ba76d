/**
 * How does a world become a map? Cells at the height of the eye and below it, seen from above, and the way between metres and
 * pixels of a map. North, the top of the map, is −Z.
 */
import type { Bounds, Vec3 } from "../basics/geometry.ts";
import type { CellEntry } from "../documents/documents.ts";

/** A place on a map, in its pixels from the top left. */
export interface Spot {
  readonly x: number;
  readonly y: number;
}

/** What of the world a map shows. */
export class MapFrame {
  readonly px_per_m: number;
  /** From its left to its right. */
  readonly width_m: number;
  private readonly west: number;
  private readonly north: number;

  /**
   * Shows the surroundings of the eye, but nothing beyond the ground where there is enough of that, nor beyond what matters of it where
   * there is enough of that; where there is not, all that matters is in the middle.
   */
  constructor(
    private readonly eye: Vec3,
    ground: Bounds,
    private readonly width_px: number,
    private readonly height_px: number,
    reach_m: number,
    matters = ground,
  ) {
    this.px_per_m = Math.min(width_px, height_px) / (2 * reach_m);
    this.width_m = width_px / this.px_per_m;
    this.west = this.edge([matters, ground], 0, width_px);
    this.north = this.edge([matters, ground], 2, height_px);
  }

  /** Within each of these boxes, the last of which counts most. */
  private edge(boxes: readonly Bounds[], axis: 0 | 2, size_px: number): number {
    const size_m = size_px / this.px_per_m;
    let edge_m = this.eye[axis] - size_m / 2;
    for (const { min, max } of boxes) {
      const isEnough = size_m < max[axis] - min[axis];
      edge_m = isEnough
        ? Math.min(max[axis] - size_m, Math.max(min[axis], edge_m))
        : (min[axis] + max[axis] - size_m) / 2;
    }
    return edge_m;
  }

  /** The spot on the map that is nearest to one, some pixels from its edge. */
  nearest({ x, y }: Spot, margin_px: number): Spot {
    const inside = (at: number, size_px: number) => Math.min(size_px - margin_px, Math.max(margin_px, at));
    return { x: inside(x, this.width_px), y: inside(y, this.height_px) };
  }

  spot([x, , z]: Vec3): Spot {
    return { x: (x - this.west) * this.px_per_m, y: (z - this.north) * this.px_per_m };
  }

  /** The point of the world at a spot, at the height of the eye. */
  place({ x, y }: Spot): Vec3 {
    return [this.west + x / this.px_per_m, this.eye[1], this.north + y / this.px_per_m];
  }

  /** What a box covers: left, top, width and height in pixels. */
  rectangle({ min, max }: Bounds): readonly [number, number, number, number] {
    const { x, y } = this.spot(min);
    return [x, y, (max[0] - min[0]) * this.px_per_m, (max[2] - min[2]) * this.px_per_m];
  }
}

/** What a map shows of a world, each cell over those that were named before it. */
export interface FloorPlan {
  /** What one looks down on from there, the lowest last: the ground, and not the air above it. */
  readonly below: readonly CellEntry[];
  /** The storey in which one could stand there, the highest last. */
  readonly storey: readonly CellEntry[];
}

/** Nobody stands so high above the floor, but who is a giant: then a share of a person's size says how much. */
const STANDING_M = 2;

/** The plan for an eye at a height; below all cells that of the lowest ones. What is above the eye is not on it. */
export function floorPlan(cells: Iterable<CellEntry>, height_m: number, size: number): FloorPlan {
  const floorOf = ({ bounds }: CellEntry) => bounds.min[1];
  const upwards = [...cells].sort((a, b) => floorOf(a) - floorOf(b));
  const [lowest] = upwards;
  const eye_m = lowest ? Math.max(height_m, floorOf(lowest)) : height_m;
  const under = upwards.filter((cell) => floorOf(cell) <= eye_m);
  const isInReach = (cell: CellEntry) => floorOf(cell) >= eye_m - STANDING_M * size && cell.bounds.max[1] >= eye_m;
  return { below: under.filter((cell) => !isInReach(cell)).reverse(), storey: under.filter(isInReach) };
}

/** The cell that a map shows at a point: of those that lie there, what is drawn last. */
export function cellOnMap({ below, storey }: FloorPlan, [x, , z]: Vec3): CellEntry | undefined {
  const isThere = ({ bounds: { min, max } }: CellEntry) => min[0] <= x && x <= max[0] && min[2] <= z && z <= max[2];
  return [...below, ...storey].reverse().find(isThere);
}
