/**
 * What does a file cost each of many models that wait for it? Rules from which many would grow come once, so each of these counts
 * its share of them (`client/src/strategy/sharing.rs`): else levels of many models come instead, one by one, of which none
 * alone costs more than all of the rules.
 */
import type { Model } from "../documents/modeldocument.ts";
import type { CostOf } from "./file.ts";

/** The same costs for models of which nothing is here, each once. */
export function shared(models: readonly Model[], costOf: CostOf): CostOf {
  const waiting = new Map<string, number>();
  for (const { rules } of models) {
    if (!rules) continue;
    for (const { url } of [rules.file, ...rules.imports.values()]) waiting.set(url, (waiting.get(url) ?? 0) + 1);
  }
  return (file) => costOf(file) / (waiting.get(file.url) ?? 1);
}
