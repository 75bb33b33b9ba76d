/**
 * What is a person told of a visit, and how often? Where the eye is and how much of what can be seen is here: the display and the page's
 * address are brought up to date while they change, and the last minute is remembered.
 */
import type { Explorer } from "../core/explorer/explorer.ts";
import type { Pose } from "../core/movement/address.ts";
import type { Progress } from "../core/strategy/progress.ts";
import { QualityHistory } from "../core/strategy/quality.ts";

export interface Readings {
  readonly cell: number | undefined;
  /** Whether the eye is in that cell; else it is the nearest. */
  readonly inside: boolean;
  /** Nothing while nobody knows what can be seen. */
  readonly visible: number | undefined;
  readonly objects: number;
  readonly fetched_bytes: number;
  readonly whole_bytes: number | undefined;
  /** Of this cell; nothing while nobody knows what can be seen from it. */
  readonly progress: Progress | undefined;
  readonly settled: boolean;
}

/** How one gets about; what is frozen is flown around in. */
export type Moving = "fly" | "walk" | "frozen";

/** What tells it. */
export interface Display {
  title(text: string): void;
  mode(mode: Moving): void;
  show(readings: Readings): void;
}

const [QUALITY_EVERY_MS, QUALITY_SPAN_MS] = [250, 60_000];
const DISPLAY_EVERY_MS = 100;
const ADDRESS_EVERY_MS = 500;

export class Reporter {
  readonly quality = new QualityHistory(QUALITY_EVERY_MS, QUALITY_SPAN_MS);
  private displayStale = true;
  private wasBusy = false;
  private displayed_ms = 0;
  private addressStale = false;
  private addressWritten_ms = 0;

  /** `posed` is told of the pose every now and then while it changes. */
  constructor(
    private readonly display: Display,
    private readonly posed: (pose: Pose) => void = () => {},
  ) {}

  /** Something that is displayed has changed. */
  changed(): void {
    this.displayStale = true;
  }

  /** The eye has moved. */
  moved(): void {
    this.displayStale = true;
    this.addressStale = true;
  }

  report(now_ms: number, explorer: Explorer, pose: Pose): void {
    this.quality.sample(now_ms, () => explorer.quality());
    const isDue = now_ms - this.displayed_ms >= DISPLAY_EVERY_MS;
    const isBusy = explorer.pending > 0;
    // What ends between two times of display is shown at the next, whatever else happens.
    if (this.wasBusy && !isBusy) this.displayStale = true;
    this.wasBusy = isBusy;
    if (isDue && (this.displayStale || isBusy)) {
      this.displayed_ms = now_ms;
      this.displayStale = false;
      this.show(explorer);
    }
    if (this.addressStale && now_ms - this.addressWritten_ms >= ADDRESS_EVERY_MS) {
      this.addressWritten_ms = now_ms;
      this.addressStale = false;
      this.posed(pose);
    }
  }

  private show(explorer: Explorer): void {
    const { manifest, pointer, queue } = explorer.scene;
    this.display.show({
      cell: explorer.cellId,
      inside: explorer.inside,
      visible: explorer.visibleCount,
      objects: manifest.counts.objects,
      fetched_bytes: queue.tally.bytes,
      whole_bytes: pointer.bytes.get("published") ?? pointer.bytes.get("level0"),
      settled: explorer.settled,
      progress: explorer.progress(),
    });
  }
}
