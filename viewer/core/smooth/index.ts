/**
 * What does a reader of smooth LODs need? Bytes in as they arrive, meshes out (`docs/SLOD.md`).
 */
export { SmoothDecoder } from "./decoder.ts";
export type { Cut, Header } from "./header.ts";
export { SmoothError } from "./rans.ts";
export { type Lattice, latticeOf, type Snapshot, snapshotOf } from "./snapshot.ts";
