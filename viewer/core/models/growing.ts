/**
 * Where do models grow out of their rules? In a worker: a tree takes tens of milliseconds, and the picture keeps moving
 * meanwhile. Where a page may start none, as in one of another origin that embeds a world, nothing is grown and levels are fetched.
 */
import { WorkerOrders, type WorkerPort } from "../pace/workerorders.ts";
import { type Amounts, LIMITS, type Recipe } from "../procedural/index.ts";

/** What to grow: texts, and what to make of them. */
export interface Seedling extends Recipe {
  readonly seed: number;
  /** As many as its finest level has. */
  readonly triangles: number;
}

/** What each triangle of a finest level may take to grow: many times what it takes in any world that one would publish. */
const STEPS_EACH = 1000;
const TRIANGLES_EACH = 16;
/** What comes besides: what its file computes for all, and triangles of what is no part of the level. */
const STEPS_BESIDES = 20_000_000;
const TRIANGLES_BESIDES = 100_000;

/**
 * What rules may take whose finest level has so many triangles. The language's own limits are those of a bake, which may take
 * minutes; rules that need more than this have levels, which are fetched.
 */
export function limitsOf(triangles: number): Pick<Amounts, "steps" | "triangles"> {
  return {
    steps: Math.min(LIMITS.steps, STEPS_BESIDES + STEPS_EACH * triangles),
    triangles: Math.min(LIMITS.triangles, TRIANGLES_BESIDES + TRIANGLES_EACH * triangles),
  };
}

/** Grows models. */
export interface Growing {
  /** A GLB of the finest level of detail. Fails where the rules are wrong. */
  grow(seedling: Seedling): Promise<ArrayBuffer>;
  /** Ends what was started. */
  end(): void;
}

/** The texts of rules, and of what they import. */
type Texts = Pick<Seedling, "rules" | "imports">;

/** What the page orders. Texts are known by a number, and travel with the first order that needs them. */
export interface Order extends Omit<Seedling, "rules" | "imports"> {
  readonly book: number;
  readonly texts: Texts | undefined;
}

export type Port = WorkerPort<Order & { readonly id: number }, ArrayBuffer>;

/** Has a worker grow, which starts with the first model. */
export class WorkerGrowing implements Growing {
  private orders: WorkerOrders<Order, ArrayBuffer> | undefined;
  /** Texts that the worker has; their places are their numbers. */
  private books: Texts[] = [];

  constructor(private readonly begin: () => Port) {}

  grow(seedling: Seedling): Promise<ArrayBuffer> {
    this.orders ??= new WorkerOrders(this.begin(), "grows models");
    const { rules, imports, ...making } = seedling;
    const known = this.books.findIndex((book) => areSame(book, seedling));
    if (known >= 0) return this.orders.ask({ ...making, book: known, texts: undefined });
    const texts = { rules, imports };
    return this.orders.ask({ ...making, book: this.books.push(texts) - 1, texts });
  }

  end(): void {
    this.orders?.end();
    this.orders = undefined;
    this.books = [];
  }
}

function areSame(a: Texts, b: Texts): boolean {
  return (
    a.rules === b.rules &&
    a.imports.size === b.imports.size &&
    [...a.imports].every(([name, text]) => b.imports.get(name) === text)
  );
}

/** A worker of the page's own origin. */
export function growing(): Growing {
  return new WorkerGrowing(
    () => new Worker(new URL("./growworker.ts", import.meta.url), { type: "module" }) as unknown as Port,
  );
}
