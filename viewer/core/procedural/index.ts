/** What does a client need to grow procedural models itself? Texts in, triangles out (`docs/PROCEDURAL.md`). */
export { type Affine, columns } from "./affine.ts";
export type { Bounds } from "./bounds.ts";
export { type Caller, DcgError } from "./error.ts";
export { grow, type Settings } from "./evaluator/index.ts";
export type { Boxes } from "./evaluator/state.ts";
export { insideFolder } from "./folder.ts";
export { type Grown, type Instance, instancesOf, type Part, type Surface } from "./grown.ts";
export { type Amounts, FINEST, LIMITS } from "./limits.ts";
export { type Load, type Program, readProgram } from "./link.ts";
export { type GrownModel, growModel, type Recipe, Rulebook } from "./recipe.ts";
export type { Mesh } from "./solid/mesh.ts";
export { type Value, valueFromJson } from "./value.ts";
