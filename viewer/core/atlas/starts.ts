/**
 * In which cell does one begin? Where the scene has a start for it, one document says that, which cells are around, and all
 * about what can be seen from there, instead of the chunks of the index that say the same among much else (`client/src/start.rs`).
 */
import { holdsAlone } from "../basics/convex.ts";
import { distanceToBounds, type Vec3 } from "../basics/geometry.ts";
import type { CellEntry, FileRef, Start } from "../documents/documents.ts";
import { forgive, type Loss, type Retried } from "../fetch/losses.ts";
import { FetchError } from "../fetch/transfer.ts";
import { Gate } from "../pace/gate.ts";
import { PRIORITY } from "../strategy/priority.ts";
import type { CellIndex, Located } from "./cellindex.ts";
import type { ObjectDirectory } from "./objects.ts";
import type { PublishedScene } from "./published.ts";
import type { Locator } from "./whereabouts.ts";

/** Asks the index, but for who begins where there is a start. */
export class Starts implements Locator {
  /** To be opened when a start takes too long: the index says the same. */
  readonly late = new Gate();
  /** Those that cannot be had; each is asked for once, until one tries again: who stands where no cell is known asks all the while. */
  private readonly lost = new Map<string, Loss>();

  constructor(
    private readonly scene: PublishedScene,
    private readonly index: CellIndex,
    private readonly directory: ObjectDirectory,
    /** Told when a start comes after it was done without. */
    private readonly came: () => void,
  ) {}

  nextDoor(from: CellEntry, point: Vec3): CellEntry | undefined {
    return this.index.nextDoor(from, point);
  }

  async locate(point: Vec3): Promise<Located | undefined> {
    const entry = await this.startAt(point);
    return entry ? { entry, distance_m: 0 } : this.index.locate(point);
  }

  /** Takes in what the start of a cell tells of what can be seen from there, where parts of the index are lost; answers whether there is one. */
  async takeFor(cell: number): Promise<boolean> {
    const named = this.scene.manifest.starts.find((start) => start.cell === cell);
    const start = named && (await this.read(named));
    if (start) this.directory.take(start);
    return start !== undefined;
  }

  /** Tries again what could not be had. */
  forgive(retried: Retried): void {
    forgive(this.lost, retried);
  }

  private async read(named: FileRef): Promise<Start | undefined> {
    if (this.lost.has(named.url)) return undefined;
    try {
      return await this.scene.start(named, PRIORITY.document);
    } catch (error) {
      if (!(error instanceof FetchError && error.isCancelled)) this.lost.set(named.url, { error });
      return undefined;
    }
  }

  /** The cell that surely holds a point, unless it was met already. A start that cannot be had is done without. */
  private async startAt(point: Vec3): Promise<CellEntry | undefined> {
    const named = this.scene.manifest.starts.find(({ bounds, bytes, grownBytes }) => {
      return distanceToBounds(bounds, point) === 0 && (!this.directory.grows || bytes <= grownBytes);
    });
    if (!named || this.index.known(named.cell)) return undefined;
    const coming = this.read(named);
    const take = (start: Start | undefined) => {
      const here = start?.cells.find(({ cell }) => cell === start.start);
      if (!start || here?.cell !== named.cell || !holdsAlone(here, point)) return undefined;
      for (const entry of start.cells) this.index.meet(entry);
      this.directory.take(start);
      return here;
    };
    let isLate = false;
    const late = this.late.next().then(() => {
      isLate = true;
      return undefined;
    });
    // It may still come before what is read instead.
    void coming.then((start) => isLate && take(start) && this.came());
    return take(await Promise.race([coming, late]));
  }
}
