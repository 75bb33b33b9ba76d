/** What of the client's strategy does a visitor without a picture need? */
export { Explorer } from "../core/explorer.ts";
export { FETCH_DEFAULTS, FetchQueue } from "../core/fetchqueue.ts";
export { FrameBudget } from "../core/framebudget.ts";
export { WorkerGrowing } from "../core/growing.ts";
export { PublishedScene } from "../core/published.ts";
export { LINES, Throttle } from "../core/throttle.ts";
export { Tree } from "../core/tree.ts";
export { webCryptoDigest } from "../core/verify.ts";
