/**
 * Where does the shelf keep things? In the browser's Cache Storage. A worker writes: to make a response of each file and hand it over
 * takes a page as long as to draw with it. Where a page may start no worker, it writes itself.
 */
import { WorkerOrders, type WorkerPort } from "../pace/workerorders.ts";
import type { Compartment, Compartments } from "./shelf.ts";

/** Something to be kept. */
export interface Keeping {
  readonly cache: string;
  readonly url: string;
  readonly bytes: ArrayBuffer;
}

/** Keeps it, under its size. */
export async function keepIn(caches: CacheStorage, { cache, url, bytes }: Keeping): Promise<void> {
  const compartment = await caches.open(cache);
  await compartment.put(url, new Response(bytes, { headers: { "Content-Length": String(bytes.byteLength) } }));
}

/** Keeps it as well as may be. */
type Keep = (keeping: Keeping) => Promise<unknown>;

/** The compartments of this browser, where it has any. */
export function compartments(
  caches: CacheStorage | undefined,
  keep: Keep | undefined = caches && keeping(caches),
): Compartments | undefined {
  if (!caches || !keep) return undefined;
  return {
    open: async (cache): Promise<Compartment> => {
      const compartment = await caches.open(cache);
      return {
        match: (url) => compartment.match(url),
        delete: (url) => compartment.delete(url),
        keys: () => compartment.keys(),
        put: async (url, bytes) => {
          await keep({ cache, url, bytes });
        },
      };
    },
  };
}

type Port = WorkerPort<Keeping & { readonly id: number }, undefined>;

function keeping(caches: CacheStorage): Keep {
  try {
    const worker = new Worker(new URL("./shelfworker.ts", import.meta.url), { type: "module" });
    const orders = new WorkerOrders(worker as unknown as Port, "keeps files");
    // What the worker cannot do, the page tries.
    return (one) => orders.ask(one).catch(() => keepIn(caches, one));
  } catch {
    return (one) => keepIn(caches, one);
  }
}
