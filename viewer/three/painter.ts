/**
 * Which meshes of a model can be drawn as one? Those that differ in plain paint only: opaque, without pictures, seen from the same sides,
 * at the same place. Each model has such a mesh for one or two sides then, instead of one for each paint, and all models share a
 * material for each of these, so that the graphics card learns of it once for a picture.
 *
 * That costs a copy. Published levels take no more memory then, since the paint stands in what their positions leave of 8 bytes. What
 * was grown and rungs take 4 bytes more for a vertex of 24, and one vertex more for each further paint of it: in the town 15 % for a sixth
 * of the draw calls, so no model is left out for that. Neither are meshes that stand alone in their model: they save no call, but else
 * each paint would be a material that three.js sets up anew in each picture.
 */
import { Mesh, MeshStandardMaterial, Texture } from "three";
import { formOf, merged, type Piece } from "./mergedgeometry.ts";
import type { Drawn } from "./modelbatch.ts";
import { type Finish, paintMaterial } from "./paintmaterial.ts";
import { Palette } from "./palette.ts";

type PlainMesh = Mesh & { readonly material: MeshStandardMaterial };

/** A model whose plain parts are painted. */
export interface Painted {
  /** What draws them; its materials belong to all models. */
  readonly painted: readonly Mesh[];
  readonly others: readonly Drawn[];
  /** What it uses until that is released. */
  readonly paints: readonly number[];
}

export class Painter {
  private readonly palette = new Palette();
  private readonly materials = new Map<string, MeshStandardMaterial>();

  /** Draws the parts of a model by as few meshes as can be; they carry in `matrixWorld` where they are. */
  paint(parts: readonly Drawn[]): Painted {
    const alike = new Map<string, { first: PlainMesh; pieces: Piece[] }>();
    const others: Drawn[] = [];
    for (const part of parts) {
      const paint = isPlain(part) ? this.palette.take(part.material) : undefined;
      if (!isPlain(part) || paint === undefined) {
        others.push(part);
        continue;
      }
      const key = `${keyOf(part.material)} ${formOf(part.geometry)} ${part.matrixWorld.elements}`;
      const group = alike.get(key) ?? { first: part, pieces: [] };
      alike.set(key, group);
      group.pieces.push({ geometry: part.geometry, paint });
    }
    const groups = [...alike.values()];
    const paints = groups.flatMap(({ pieces }) => pieces.map(({ paint }) => paint));
    return { painted: groups.map(({ first, pieces }) => this.join(first, pieces)), others, paints };
  }

  release(paints: readonly number[]): void {
    for (const paint of paints) this.palette.release(paint);
  }

  /** Frees what the graphics card has; it can be used on. */
  dispose(): void {
    this.palette.dispose();
    for (const material of this.materials.values()) material.dispose();
  }

  private join({ material, matrixWorld }: PlainMesh, pieces: readonly Piece[]): Mesh {
    const mesh = new Mesh(merged(pieces), this.materialOf(material));
    mesh.matrixWorld.copy(matrixWorld);
    return mesh;
  }

  private materialOf(finish: Finish): MeshStandardMaterial {
    const key = keyOf(finish);
    const material = this.materials.get(key) ?? paintMaterial(this.palette.uniform, finish);
    this.materials.set(key, material);
    return material;
  }
}

function keyOf({ side, vertexColors, flatShading }: Finish): string {
  return `${side} ${vertexColors} ${flatShading}`;
}

/** Whether there is nothing about it but its paint. */
function isPlain(part: Drawn): part is PlainMesh {
  const { material } = part;
  if (part.constructor !== Mesh || !(material instanceof MeshStandardMaterial)) return false;
  if (!part.geometry.hasAttribute("position")) return false;
  const isMore = material.constructor !== MeshStandardMaterial || material.transparent || material.alphaTest > 0;
  const isMorphed = Object.keys(part.geometry.morphAttributes).length > 0;
  return !isMore && !isMorphed && !Object.values(material).some((value) => value instanceof Texture);
}
