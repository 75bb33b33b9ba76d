/** Where may one walk? The hulls and openings of the cells that were met, as the walker asks for them. */
import type { CellIndex } from "../atlas/cellindex.ts";
import type { CellRecords } from "../atlas/cellrecords.ts";
import { planesOfCell } from "../basics/convex.ts";
import { planesOfHull } from "../basics/geometry.ts";
import type { NavigationCell } from "./walker.ts";

export class MetCells {
  private readonly cells = new Map<number, NavigationCell>();

  constructor(
    private readonly index: CellIndex,
    private readonly records: CellRecords,
  ) {}

  /** `undefined` while the cell was not met; without openings while its record was not read. */
  cell(id: number): NavigationCell | undefined {
    const known = this.cells.get(id);
    if (known?.portals) return known;
    const entry = this.index.known(id);
    if (!entry) return undefined;
    const record = this.records.known(id);
    if (known && !record) return known;
    const cell: NavigationCell = {
      cell: id,
      planes: record ? planesOfHull(record.hull.points, record.hull.faces) : planesOfCell(entry),
      adjacent: entry.adjacent,
      portals: record?.portals,
    };
    this.cells.set(id, cell);
    return cell;
  }
}
