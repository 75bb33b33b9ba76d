/**
 * What of the core is of use to another program? What walks through a published scene: it says what can be seen and fetches it, and
 * leaves drawing to a host of one's own. `examples/look.mjs` shows the least that it takes.
 */
export type { Uses } from "./atlas/objects.ts";
export { fetchSceneList, PublishedScene } from "./atlas/published.ts";
export type { Bounds, Vec3 } from "./basics/geometry.ts";
export { DocumentError } from "./basics/json.ts";
export type { SceneSummary, Viewpoint } from "./documents/documents.ts";
export type { PlacedObject } from "./documents/placedobject.ts";
export { Explorer, type ExplorerEvents, type ExplorerOptions } from "./explorer/explorer.ts";
export { FETCH_DEFAULTS, FetchQueue, type FetchQueueOptions } from "./fetch/fetchqueue.ts";
export { RequestLog } from "./fetch/requestlog.ts";
export { FetchError } from "./fetch/transfer.ts";
export { Tree } from "./fetch/tree.ts";
export { webCryptoDigest } from "./fetch/verify.ts";
export type { Decoded, ModelHost } from "./models/modelloads.ts";
export type { Mode, Pose } from "./movement/address.ts";
export { Walker } from "./movement/walker.ts";
export { FrameBudget } from "./pace/framebudget.ts";
export * as procedural from "./procedural/index.ts";
export * as select from "./select/index.ts";
export { compartments } from "./shelf/compartments.ts";
export { Shelf } from "./shelf/shelf.ts";
export * as smooth from "./smooth/index.ts";
export type { Progress } from "./strategy/progress.ts";
export { MemoryShortError, type Part } from "./strategy/residency.ts";
export type { Eye } from "./strategy/sight.ts";
