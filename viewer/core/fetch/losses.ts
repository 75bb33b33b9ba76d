/**
 * What may be tried again of what could not be had? A server that is silent, busy or out of order may be well again soon, and so may
 * the way from there, on which things break off; what it does not have, or holds damaged, stays so until somebody sees to it.
 */
import type { Answer } from "./pauses.ts";
import { FetchError } from "./transfer.ts";

/** All of it, as when somebody asks for that, or only what failed for a reason that passes. */
export type Retried = "all" | "passing";

export interface Loss {
  readonly error: unknown;
}

/** Of how a download failed: whether another try may bring it. */
export function mayPass(kind: FetchError["kind"]): boolean {
  // What is forgone is a better buy once its server turns out to answer ranges.
  return kind === "unreachable" || kind === "broken" || kind === "forgone";
}

/** Whether something failed for a reason that passes by itself. */
export function passes(error: unknown): boolean {
  if (error instanceof FetchError) return mayPass(error.kind);
  return error instanceof Error && passes(error.cause);
}

/** What was answered to what failed, where something was. */
export function answerOf(error: unknown): Answer | undefined {
  if (error instanceof FetchError) return error.headers && { headers: error.headers };
  return error instanceof Error ? answerOf(error.cause) : undefined;
}

export function mayRetry({ error }: Loss, retried: Retried): boolean {
  return retried === "all" || passes(error);
}

/** Forgets losses, so that they are tried again. */
export function forgive<Key>(losses: Map<Key, Loss>, retried: Retried): void {
  for (const [key, loss] of losses) if (mayRetry(loss, retried)) losses.delete(key);
}
