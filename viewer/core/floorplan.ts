/**
 * How does a world become a map? Cells at the height of the eye, seen from above, and the way between metres and pixels
 * of a map. North, the top of the map, is −Z.
 */
import type { CellEntry } from "./documents.ts";
import type { Bounds, Vec3 } from "./geometry.ts";

/** A place on a map, in its pixels from the top left. */
export interface Spot {
  readonly x: number;
  readonly y: number;
}

/** What of the world a map shows. */
export class MapFrame {
  private readonly px_per_m: number;
  private readonly west: number;
  private readonly north: number;

  /** Shows the surroundings of a point, or the whole world where that is smaller. */
  constructor(
    private readonly centre: Vec3,
    world: Bounds,
    width_px: number,
    height_px: number,
    reach_m: number,
  ) {
    const span_m = Math.max(1, Math.min(2 * reach_m, Math.max(sizeOf(world, 0), sizeOf(world, 2)) * 1.1));
    this.px_per_m = Math.min(width_px, height_px) / span_m;
    const fits = span_m < 2 * reach_m;
    const middle = (axis: 0 | 2) => (fits ? (world.min[axis] + world.max[axis]) / 2 : centre[axis]);
    this.west = middle(0) - width_px / this.px_per_m / 2;
    this.north = middle(2) - height_px / this.px_per_m / 2;
  }

  spot([x, , z]: Vec3): Spot {
    return { x: (x - this.west) * this.px_per_m, y: (z - this.north) * this.px_per_m };
  }

  /** The point of the world at a spot, at the height of the centre. */
  place({ x, y }: Spot): Vec3 {
    return [this.west + x / this.px_per_m, this.centre[1], this.north + y / this.px_per_m];
  }

  /** What a box covers: left, top, width and height in pixels. */
  rectangle({ min, max }: Bounds): readonly [number, number, number, number] {
    const { x, y } = this.spot(min);
    return [x, y, (max[0] - min[0]) * this.px_per_m, (max[2] - min[2]) * this.px_per_m];
  }
}

/**
 * The cells that a storey at a height has, the highest last, so that what is drawn later lies on top. Above and below all
 * cells that is the storey of the nearest one.
 */
export function storey(cells: Iterable<CellEntry>, height_m: number): CellEntry[] {
  const all = [...cells];
  const at = (y: number) => all.filter(({ bounds: { min, max } }) => min[1] <= y && y <= max[1]);
  let near = at(height_m);
  if (near.length === 0) {
    const heights = all.flatMap(({ bounds: { min, max } }) => [min[1], max[1]]);
    const away_m = (y: number) => Math.abs(y - height_m);
    near = at(heights.reduce((best, y) => (away_m(y) < away_m(best) ? y : best), Number.POSITIVE_INFINITY));
  }
  return near.sort((a, b) => a.bounds.min[1] - b.bounds.min[1]);
}

const sizeOf = ({ min, max }: Bounds, axis: 0 | 2) => max[axis] - min[axis];
