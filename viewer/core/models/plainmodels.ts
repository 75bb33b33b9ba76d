/**
 * What is drawn plain, because some of its textures could not be had? Its mesh is kept until they come, so that nothing of it travels again
 * but what was missing.
 */
import { type Grade, nameOf } from "../strategy/grade.ts";

/** A mesh that is drawn without some of its textures. */
export interface Plain {
  readonly glb: ArrayBuffer;
  /** Their URLs. */
  readonly lacks: readonly string[];
}

export class PlainModels {
  private readonly meshes = new Map<number, Map<string, Plain>>();

  of(model: number, grade: Grade): Plain | undefined {
    return this.meshes.get(model)?.get(nameOf(grade));
  }

  /** A mesh is drawn with all its textures but these. */
  drawn(model: number, grade: Grade, plain: Plain): void {
    const meshes = this.meshes.get(model) ?? new Map<string, Plain>();
    if (plain.lacks.length > 0) this.meshes.set(model, meshes.set(nameOf(grade), plain));
    else if (meshes.delete(nameOf(grade)) && meshes.size === 0) this.meshes.delete(model);
  }

  /** A model is drawn by these grades and no others. */
  keepOnly(model: number, grades: readonly Grade[]): void {
    const names = new Set(grades.map(nameOf));
    const meshes = this.meshes.get(model);
    for (const name of meshes?.keys() ?? []) if (!names.has(name)) meshes?.delete(name);
    if (meshes?.size === 0) this.meshes.delete(model);
  }

  /** Memory of the meshes that are kept of a model. */
  bytes(model: number): number {
    return [...(this.meshes.get(model)?.values() ?? [])].reduce((sum, { glb }) => sum + glb.byteLength, 0);
  }
}
