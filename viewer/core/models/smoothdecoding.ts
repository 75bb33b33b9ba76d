/**
 * Where are smooth LODs decoded? In a worker, so that the picture keeps moving; where there is none, as in a page of another
 * origin that embeds a world, on the page's own thread in slices of a few milliseconds.
 */
import { WorkerOrders, type WorkerPort } from "../pace/workerorders.ts";
import { type Refined, SmoothStream } from "./smoothstream.ts";

/** Decodes streams, each by a number. */
export interface SmoothDecoding {
  /** Takes in the next rungs of a stream, whose materials are told with the first ones. Fails when they are damaged. */
  refine(stream: number, rungs: readonly ArrayBuffer[], materials: string): Promise<Refined>;
  /** Forgets a stream. */
  close(stream: number): void;
  /** Forgets all of them, and ends what was started. */
  end(): void;
}

/** Decodes here, and gives the thread away after each slice. */
export class SlicedDecoding implements SmoothDecoding {
  private readonly streams = new Map<number, SmoothStream>();

  constructor(
    private readonly slice_ms = 4,
    private readonly now_ms: () => number = () => performance.now(),
  ) {}

  async refine(stream: number, rungs: readonly ArrayBuffer[], materials: string): Promise<Refined> {
    const known = this.streams.get(stream) ?? new SmoothStream(materials);
    this.streams.set(stream, known);
    const taking = known.take(rungs);
    let started_ms = this.now_ms();
    for (let step = taking.next(); ; step = taking.next()) {
      if (step.done) return step.value;
      if (this.now_ms() - started_ms < this.slice_ms) continue;
      await new Promise((resolve) => setTimeout(resolve, 0));
      started_ms = this.now_ms();
    }
  }

  close(stream: number): void {
    this.streams.delete(stream);
  }

  end(): void {
    this.streams.clear();
  }
}

/** What the page tells the worker: decode these, or forget a stream. */
export type Order =
  | { readonly stream: number; readonly rungs: readonly ArrayBuffer[]; readonly materials: string }
  | { readonly close: number };

export type Port = WorkerPort<Order & { readonly id: number }, Refined | undefined>;

/** Has a worker decode. */
export class WorkerDecoding implements SmoothDecoding {
  private readonly orders: WorkerOrders<Order, Refined | undefined>;

  constructor(worker: Port) {
    this.orders = new WorkerOrders(worker, "decodes smooth LODs");
  }

  async refine(stream: number, rungs: readonly ArrayBuffer[], materials: string): Promise<Refined> {
    const refined = await this.orders.ask({ stream, rungs, materials });
    if (!refined) throw new Error("the worker that decodes smooth LODs answered nothing");
    return refined;
  }

  close(stream: number): void {
    // Where the worker is gone, so is the stream.
    this.orders.ask({ close: stream }).catch(() => {});
  }

  end(): void {
    this.orders.end();
  }
}

/** The best there is here. A page may start workers of its own origin only. */
export function smoothDecoding(): SmoothDecoding {
  try {
    const worker = new Worker(new URL("./smoothworker.ts", import.meta.url), { type: "module" });
    return new WorkerDecoding(worker as unknown as Port);
  } catch {
    return new SlicedDecoding();
  }
}
