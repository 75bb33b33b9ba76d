/** What is an object once its entry and its model have been read, or what stands for them? */
import type { ObjectEntry } from "./documents.ts";
import type { Model } from "./modeldocument.ts";

/** A placed object and the geometry that it shares. */
export interface PlacedObject {
  readonly entry: ObjectEntry;
  readonly model: Model;
}

/** How far the surface of a level or rung may be from the source's, in metres in the world. */
export function geometricError_m(object: PlacedObject, grade: { readonly geometricError: number }): number {
  return grade.geometricError * object.entry.scale;
}
