/** What does the worker do that grows models? What the page orders, one model after the other. Rules are read once. */
import { obey } from "../pace/workerorders.ts";
import { Rulebook } from "../procedural/index.ts";
import { limitsOf, type Order } from "./growing.ts";
import { grownGlb } from "./grownglb.ts";

/** By their numbers; a world seldom has more than a few. */
const rulebooks = new Map<number, Rulebook>();

function rulebookOf({ book, texts }: Order): Rulebook {
  if (texts) rulebooks.set(book, new Rulebook(texts));
  const known = rulebooks.get(book);
  if (!known) throw new Error("the rules that this grows from could not be read");
  return known;
}

obey<Order & { readonly id: number }, ArrayBuffer>(
  (order) => grownGlb(rulebookOf(order).grow(order, { seed: order.seed, limits: limitsOf(order.triangles) })),
  (glb) => [glb],
);
