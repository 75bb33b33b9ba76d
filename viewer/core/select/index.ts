/**
 * Which triangles of one smooth LOD are worth drawing from here? Fine ones near the eye and in the view, few far away.
 *
 * `crates/scene/src/smooth/select` does the same in the same order, with the same floating-point operations: the same
 * stream and the same views give the same triangles, bit for bit (`tests/golden/smooth/views.json`).
 */
export { type Progress, Selection } from "./selection.ts";
export { ClusterTree } from "./tree.ts";
export type { View } from "./view.ts";
