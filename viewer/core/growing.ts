/**
 * Where do models grow out of their rules? In a worker: a tree takes tens of milliseconds, and the picture keeps moving
 * meanwhile. Where a page may start none, as in one of another origin that embeds a world, nothing is grown and levels are fetched.
 */
import type { Recipe } from "./procedural/index.ts";
import { WorkerOrders, type WorkerPort } from "./workerorders.ts";

/** What to grow: texts, and what to make of them. */
export interface Seedling extends Recipe {
  readonly seed: number;
}

/** Grows models. */
export interface Growing {
  /** A GLB of the finest level of detail. Fails where the rules are wrong. */
  grow(seedling: Seedling): Promise<ArrayBuffer>;
  /** Ends what was started. */
  end(): void;
}

export type Port = WorkerPort<Seedling & { readonly id: number }, ArrayBuffer>;

/** Has a worker grow, which starts with the first model. */
export class WorkerGrowing implements Growing {
  private orders: WorkerOrders<Seedling, ArrayBuffer> | undefined;

  constructor(private readonly begin: () => Port) {}

  grow(seedling: Seedling): Promise<ArrayBuffer> {
    this.orders ??= new WorkerOrders(this.begin(), "grows models");
    return this.orders.ask(seedling);
  }

  end(): void {
    this.orders?.end();
    this.orders = undefined;
  }
}

/** A worker of the page's own origin. */
export function growing(): Growing {
  return new WorkerGrowing(
    () => new Worker(new URL("./growworker.ts", import.meta.url), { type: "module" }) as unknown as Port,
  );
}
