/** What of the client's strategy does a visitor without a picture need? */
export { PublishedScene } from "../core/atlas/published.ts";
export { Explorer } from "../core/explorer/explorer.ts";
export { FETCH_DEFAULTS, FetchQueue } from "../core/fetch/fetchqueue.ts";
export { LINES, Throttle } from "../core/fetch/throttle.ts";
export { Tree } from "../core/fetch/tree.ts";
export { webCryptoDigest } from "../core/fetch/verify.ts";
export { WorkerGrowing } from "../core/models/growing.ts";
export { FrameBudget } from "../core/pace/framebudget.ts";
