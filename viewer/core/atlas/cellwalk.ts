/**
 * In which cell is a point, for one who knows in which cell it was a moment ago? Steps from cell to adjacent cell towards
 * the point (Marvie & Bouatouch, A VRML97-X3D extension for massive scenery management in virtual worlds, 2004, §3.4),
 * at a cost that does not depend on the size of the world. A point on a face, edge or corner may belong to cells that are
 * not adjacent, so there the walk leaves the answer to the index, and both agree everywhere.
 */
import { distanceToCell, holdsAlone } from "../basics/convex.ts";
import type { Vec3 } from "../basics/geometry.ts";
import type { CellEntry } from "../documents/documents.ts";

/** A walk that has not arrived after so many cells is given up. */
const MAX_CELLS = 16;

/** The cell that holds a point and no other does; `undefined` when only the index can tell. */
export function walkTo(
  from: CellEntry,
  point: Vec3,
  known: (cell: number) => CellEntry | undefined,
): CellEntry | undefined {
  let at = from;
  let distance_m = distanceToCell(at, point);
  if (holdsAlone(at, point)) return at;
  for (let cells = 0; distance_m > 0 && cells < MAX_CELLS; cells += 1) {
    const next = at.adjacent.map(known).filter((entry) => entry !== undefined);
    const alone = next.find((entry) => holdsAlone(entry, point));
    if (alone) return alone;
    const reach = next.map((entry) => ({ entry, distance_m: distanceToCell(entry, point) }));
    reach.sort((a, b) => a.distance_m - b.distance_m || a.entry.cell - b.entry.cell);
    const nearest = reach[0];
    if (!nearest || nearest.distance_m >= distance_m) return undefined;
    ({ entry: at, distance_m } = nearest);
  }
  return undefined;
}
