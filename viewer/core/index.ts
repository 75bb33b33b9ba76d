/**
 * What of the core is of use to another program? What walks through a published scene: it says what can be seen and fetches it, and
 * leaves drawing to a host of one's own. `examples/look.mjs` shows the least that it takes.
 */
export type { Mode, Pose } from "./address.ts";
export { compartments } from "./compartments.ts";
export type { SceneSummary, Viewpoint } from "./documents.ts";
export { Explorer, type ExplorerEvents, type ExplorerOptions } from "./explorer.ts";
export { FETCH_DEFAULTS, FetchQueue, type FetchQueueOptions } from "./fetchqueue.ts";
export { FrameBudget } from "./framebudget.ts";
export type { Bounds, Vec3 } from "./geometry.ts";
export { DocumentError } from "./json.ts";
export type { Decoded, ModelHost } from "./modelloads.ts";
export type { PlacedObject, Uses } from "./objects.ts";
export * as procedural from "./procedural/index.ts";
export type { Progress } from "./progress.ts";
export { fetchSceneList, PublishedScene } from "./published.ts";
export { RequestLog } from "./requestlog.ts";
export { MemoryShortError, type Part } from "./residency.ts";
export type { Eye } from "./screenerror.ts";
export { Shelf } from "./shelf.ts";
export { FetchError } from "./transfer.ts";
export { Tree } from "./tree.ts";
export { webCryptoDigest } from "./verify.ts";
export { Walker } from "./walker.ts";
