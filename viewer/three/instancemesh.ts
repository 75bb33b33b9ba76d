/** How is one part of a model drawn for all of its objects that are in view, and which of them does a ray meet, in view or not? */
import { InstancedMesh, type Intersection, Mesh, type Raycaster, Sphere } from "three";
import type { Placement } from "./placement.ts";
import type { Rows, Slots } from "./slots.ts";

/** Around an object, in the world: centre and radius. */
export const SPHERE = 4;

export class InstanceMesh extends InstancedMesh {
  /** Spheres are around whole objects, by slot. */
  constructor(
    { geometry, material }: Mesh,
    private readonly slots: Slots,
    private readonly spheres: Rows,
    private readonly placement: Placement,
  ) {
    super(geometry, material, 0);
    this.boundingSphere = placement.nearest;
    this.matrixAutoUpdate = false;
    this.receiveShadow = true;
    // What is out of view is not among the instances.
    this.frustumCulled = false;
  }

  /** The object in a slot. */
  objectIn(slot: number): number | undefined {
    return this.slots.objectIn(slot);
  }

  /** Takes over what its placement tells. */
  take(): void {
    const { attribute, worldFromMesh } = this.placement;
    if (attribute !== this.instanceMatrix) {
      // Frees what the graphics card has of the one before; three.js takes the mesh up again.
      this.dispose();
      this.instanceMatrix = attribute;
    }
    this.matrix.copy(worldFromMesh);
    this.updateMatrixWorld(true);
  }

  /** Draws the first so many. Of what is visible, even where none is drawn, the graphics card is given all that it takes. */
  draw(count: number, isIntroduced = false): void {
    this.count = count;
    this.visible = count > 0 || isIntroduced;
  }

  override raycast(raycaster: Raycaster, hits: Intersection[]): void {
    const one = new Mesh(this.geometry, this.material);
    const around = new Sphere();
    const found: Intersection[] = [];
    for (let slot = 0; slot < this.slots.count; slot += 1) {
      around.center.fromArray(this.spheres.array, slot * SPHERE);
      around.radius = this.spheres.array[slot * SPHERE + 3] ?? 0;
      if (!raycaster.ray.intersectsSphere(around)) continue;
      one.matrixWorld = this.placement.matrices.at(slot);
      one.raycast(raycaster, found);
      for (const hit of found) hits.push({ ...hit, object: this, instanceId: slot });
      found.length = 0;
    }
  }
}
