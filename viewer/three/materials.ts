/**
 * Which models use the same materials, beside those that vertices paint (`painter.ts`)? Hundreds of models of one world have the same
 * panes and leaves. three.js prepares each material for the graphics card where it is first drawn, which takes as long as to decode a
 * model, so all that have the same share one.
 */
import type { Material } from "three";
import type { Drawn } from "./modelbatch.ts";

/** What a loader knows of what it made. */
export interface Origin {
  readonly json: { readonly materials?: readonly object[] };
  readonly associations: ReadonlyMap<unknown, { readonly materials?: number }>;
}

interface Shared {
  readonly material: Material;
  users: number;
}

export class Materials {
  private readonly byKey = new Map<string, Shared>();
  private readonly keys = new Map<Material, string>();

  /** Has what is drawn use materials that others use, too; answers all that it uses then, each of which is to be released. */
  share(parts: readonly Drawn[], origin: Origin): ReadonlySet<Material> {
    const used = new Set<Material>();
    const choose = (material: Material) => {
      const shared = this.like(material, keyOf(material, origin));
      used.add(shared);
      return shared;
    };
    for (const part of parts) {
      part.material = Array.isArray(part.material) ? part.material.map(choose) : choose(part.material);
    }
    for (const material of used) this.use(material);
    return used;
  }

  /** Says that one model uses a material no more; answers whether nobody does. */
  release(material: Material): boolean {
    const key = this.keys.get(material);
    const shared = key === undefined ? undefined : this.byKey.get(key);
    if (key === undefined || !shared) return true;
    shared.users -= 1;
    if (shared.users > 0) return false;
    this.byKey.delete(key);
    this.keys.delete(material);
    return true;
  }

  /** The material with a key; this one from now on where there is none. */
  private like(material: Material, key: string | undefined): Material {
    if (key === undefined) return material;
    const shared = this.byKey.get(key) ?? { material, users: 0 };
    this.byKey.set(key, shared);
    this.keys.set(shared.material, key);
    return shared.material;
  }

  private use(material: Material): void {
    const shared = this.byKey.get(this.keys.get(material) ?? "");
    if (shared) shared.users += 1;
  }
}

/** The same for materials that look the same; `undefined` for one with pictures, whose numbers mean something in their own file only. */
function keyOf(material: Material, { json, associations }: Origin): string | undefined {
  const index = associations.get(material)?.materials;
  const definition = index === undefined ? undefined : json.materials?.[index];
  if (!definition) return undefined;
  const text = JSON.stringify({ ...definition, name: undefined });
  if (/texture/i.test(text)) return undefined;
  // What a loader adds according to the mesh.
  const { vertexColors = false, flatShading = false } = material as { vertexColors?: boolean; flatShading?: boolean };
  return `${material.type} ${vertexColors} ${flatShading} ${text}`;
}
