/**
 * May this page read from a tree at all? Its Content Security Policy may keep it from that, which a request cannot tell
 * from a server that is silent.
 */
import type { Tree } from "../core/fetch/tree.ts";
import { ForbiddenTree } from "./problem.ts";

/** What comes of reading a tree; fails when the page's policy forbids that, but not when that is only reported. */
export async function unlessForbidden<T>({ base }: Tree, reading: Promise<T>): Promise<T> {
  const over = new AbortController();
  const forbidden = new Promise<never>((_, fail) => {
    const listener = ({ disposition, effectiveDirective, blockedURI }: SecurityPolicyViolationEvent) => {
      const isOurs = effectiveDirective === "connect-src" && blockedURI.startsWith(base.origin);
      if (disposition === "enforce" && isOurs) fail(new ForbiddenTree(base.origin));
    };
    document.addEventListener("securitypolicyviolation", listener, { signal: over.signal });
  });
  try {
    return await Promise.race([reading, forbidden]);
  } finally {
    over.abort();
  }
}
