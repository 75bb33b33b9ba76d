/** What does the worker do that grows models? What the page orders, one model after the other. Rules are read once. */
import type { Seedling } from "./growing.ts";
import { grownGlb } from "./grownglb.ts";
import { Rulebook } from "./procedural/index.ts";
import { obey } from "./workerorders.ts";

/** So many are kept; a world seldom has more. */
const MOST_RULEBOOKS = 16;

const rulebooks = new Map<string, Rulebook>();

function rulebookOf({ rules, imports }: Seedling): Rulebook {
  const key = JSON.stringify([rules, ...imports]);
  const known = rulebooks.get(key) ?? new Rulebook({ rules, imports });
  if (rulebooks.size >= MOST_RULEBOOKS && !rulebooks.has(key)) rulebooks.clear();
  rulebooks.set(key, known);
  return known;
}

obey<Seedling & { readonly id: number }, ArrayBuffer>(
  (seedling) => grownGlb(rulebookOf(seedling).grow(seedling, { seed: seedling.seed })),
  (glb) => [glb],
);
