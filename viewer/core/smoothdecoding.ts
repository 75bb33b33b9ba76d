/**
 * Where are smooth LODs decoded? In a worker, so that the picture keeps moving; where there is none, as in a page of another
 * origin that embeds a world, on the page's own thread in slices of a few milliseconds.
 */
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

/** What the page tells the worker. */
export type Order =
  | { readonly id: number; readonly stream: number; readonly rungs: readonly ArrayBuffer[]; readonly materials: string }
  | { readonly close: number };

/** What the worker answers to an order with an id. */
export type Answer =
  | { readonly id: number; readonly refined: Refined }
  | { readonly id: number; readonly error: string };

/** What of a `Worker` is needed. */
export interface WorkerPort {
  postMessage(order: Order): void;
  onmessage: ((event: { readonly data: Answer }) => void) | null;
  onerror: ((event: { readonly message: string }) => void) | null;
  terminate(): void;
}

/** Has a worker decode. */
export class WorkerDecoding implements SmoothDecoding {
  private readonly waiting = new Map<number, { resolve: (refined: Refined) => void; reject: (error: Error) => void }>();
  private orders = 0;

  constructor(private readonly worker: WorkerPort) {
    worker.onmessage = ({ data }) => {
      const order = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if ("refined" in data) order?.resolve(data.refined);
      else order?.reject(new Error(data.error));
    };
    worker.onerror = ({ message }) => this.failAll(`the worker that decodes smooth LODs has failed: ${message}`);
  }

  refine(stream: number, rungs: readonly ArrayBuffer[], materials: string): Promise<Refined> {
    const id = this.orders++;
    this.worker.postMessage({ id, stream, rungs, materials });
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  close(stream: number): void {
    this.worker.postMessage({ close: stream });
  }

  end(): void {
    this.worker.terminate();
    this.failAll("nothing is decoded any more");
  }

  private failAll(why: string): void {
    for (const { reject } of this.waiting.values()) reject(new Error(why));
    this.waiting.clear();
  }
}

/** The best there is here. A page may start workers of its own origin only. */
export function smoothDecoding(): SmoothDecoding {
  try {
    const worker = new Worker(new URL("./smoothworker.ts", import.meta.url), { type: "module" });
    return new WorkerDecoding(worker as unknown as WorkerPort);
  } catch {
    return new SlicedDecoding();
  }
}
