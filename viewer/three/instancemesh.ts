/** How is one part of a model drawn for all of its objects that are in view, and which of them does a ray meet, in view or not? */
import {
  type BufferGeometry,
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedMesh,
  type Intersection,
  Mesh,
  type Raycaster,
  Sphere,
} from "three";
import type { Rows, Slots } from "./slots.ts";

export const [MATRIX, SPHERE] = [16, 4];

/** What is known of the objects, by slot. */
export interface InstanceTable {
  readonly slots: Slots;
  /** Around each object: centre and radius, in the world. */
  readonly spheres: Rows;
  /** From the part in each object to the mesh. */
  readonly matrices: Rows;
}

export class InstanceMesh extends InstancedMesh {
  /** Of what is nearest, by which three.js draws near meshes first. */
  override readonly boundingSphere = new Sphere();

  constructor(
    geometry: BufferGeometry,
    material: Mesh["material"],
    private readonly table: InstanceTable,
  ) {
    super(geometry, material, 0);
    this.matrixAutoUpdate = false;
    // What is out of view is not among the instances.
    this.frustumCulled = false;
  }

  /** The object in a slot. */
  objectIn(slot: number): number | undefined {
    return this.table.slots.objectIn(slot);
  }

  /** Draws the first instances of an attribute, the nearest of which is that in a slot. */
  draw(attribute: InstancedBufferAttribute, count: number, nearest: number): void {
    if (attribute !== this.instanceMatrix) {
      // Frees what the graphics card has of the one before; three.js takes the mesh up again.
      this.dispose();
      this.instanceMatrix = attribute;
    }
    this.count = count;
    this.visible = count > 0;
    const { array } = this.table.matrices;
    const at = nearest * MATRIX + 12;
    this.boundingSphere.center.set(array[at] ?? 0, array[at + 1] ?? 0, array[at + 2] ?? 0);
  }

  override raycast(raycaster: Raycaster, hits: Intersection[]): void {
    const { slots, spheres, matrices } = this.table;
    const one = new Mesh(this.geometry, this.material);
    const around = new Sphere();
    const found: Intersection[] = [];
    for (let slot = 0; slot < slots.count; slot += 1) {
      around.center.fromArray(spheres.array, slot * SPHERE);
      around.radius = spheres.array[slot * SPHERE + 3] ?? 0;
      if (!raycaster.ray.intersectsSphere(around)) continue;
      one.matrixWorld.fromArray(matrices.array, slot * MATRIX).premultiply(this.matrixWorld);
      one.raycast(raycaster, found);
      for (const hit of found) hits.push({ ...hit, object: this, instanceId: slot });
      found.length = 0;
    }
  }
}

/** An attribute with the matrices of these slots in turn: the one before, where they have room in it. */
export function matricesOf(
  slots: readonly number[],
  { array: from }: Rows,
  before: InstancedBufferAttribute,
): InstancedBufferAttribute {
  const attribute =
    slots.length <= before.count
      ? before
      : new InstancedBufferAttribute(new Float32Array(2 * slots.length * MATRIX), MATRIX).setUsage(DynamicDrawUsage);
  const to = attribute.array;
  slots.forEach((slot, i) => {
    for (let k = 0; k < MATRIX; k += 1) to[i * MATRIX + k] = from[slot * MATRIX + k] as number;
  });
  attribute.clearUpdateRanges();
  attribute.addUpdateRange(0, slots.length * MATRIX);
  attribute.needsUpdate = true;
  return attribute;
}
