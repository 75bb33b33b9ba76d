/**
 * How urgent is a download? Lower goes first. Each purpose has a band, refined by what is added to it.
 */
import type { Purpose } from "./requestlog.ts";

export const PRIORITY: Readonly<Record<Purpose, number>> = {
  document: 0,
  coarsest: 1_000_000,
  finer: 2_000_000,
  prefetch: 3_000_000,
};

/** In whose band a priority lies. */
export function purposeOf(priority: number): Purpose {
  if (priority >= PRIORITY.prefetch) return "prefetch";
  if (priority >= PRIORITY.finer) return "finer";
  return priority >= PRIORITY.coarsest ? "coarsest" : "document";
}
