/**
 * What does a file take on the line? Its bytes as servers compress them, and what a request takes besides. Documents say
 * how large files are, not how small they get, so each kind counts with the share that is left of it on average.
 */
import type { FileRef } from "../documents/documents.ts";

/** About what the headers of a request and its answer take; `belvedere walk` counts the same. */
export const HEADER_BYTES = 400;

/** What gzip leaves of each kind, over the built-in museum and five other worlds; all else is entropy-coded already. */
const LEFT: Readonly<Record<string, number>> = { glb: 0.47, pack: 0.31, gltf: 0.35, json: 0.21, dcg: 0.29, pop: 0.23 };

/** Bytes that a file takes until it is here, its request included. */
export type CostOf = (file: FileRef) => number;

/** The share of a file that travels; bundles are not compressed, whatever is in them. */
export function leftOf(url: string): number {
  return url.includes("/bundle/") ? 1 : (LEFT[url.slice(url.lastIndexOf(".") + 1)] ?? 1);
}

export function compressed_bytes({ url, bytes }: FileRef): number {
  return bytes * leftOf(url);
}

/** Of a file that is fetched alone, on a line of which nothing is known. */
export const costAlone_bytes: CostOf = (file) => compressed_bytes(file) + HEADER_BYTES;
