/**
 * How are many objects of one model drawn by one call for each of its parts? Each object has a slot; before each picture those in view
 * are told to the graphics card, and only where they are others than before or stand elsewhere.
 */
import { type Matrix4, type Mesh, type Object3D, Sphere, Vector3 } from "three";
import { InstanceMesh, SPHERE } from "./instancemesh.ts";
import { Placement } from "./placement.ts";
import { Rows, Slots } from "./slots.ts";
import type { ViewVolume } from "./viewvolume.ts";

/** Objects of one model that are all mirrored, or none. */
export class Instances {
  private readonly slots = new Slots();
  private readonly spheres = new Rows(SPHERE);
  private readonly placements: Placement[] = [];
  private readonly meshes: readonly InstanceMesh[];
  /** Around what is drawn, in an object. */
  private readonly sphere = new Sphere().makeEmpty();
  /** What was told at the last look: slots that were in view, and from where distances were counted. */
  private readonly seen: number[] = [];
  private readonly origin = new Vector3();
  private hasMoved = false;
  /** Whether the graphics card has never been given what they take. */
  private isUnknown = true;

  /** Parts carry in `matrixWorld` where they are in an object. What is drawn is added to `root`, which stands at the origin. */
  constructor(parts: readonly Mesh[], areMirrored: boolean, root: Object3D) {
    this.meshes = parts.map((part) => {
      const { geometry, matrixWorld: objectFromPart } = part;
      if (!geometry.boundingSphere) geometry.computeBoundingSphere();
      if (geometry.boundingSphere) this.sphere.union(geometry.boundingSphere.clone().applyMatrix4(objectFromPart));
      const same = this.placements.find((placement) => placement.objectFromPart.equals(objectFromPart));
      const placement = same ?? new Placement(objectFromPart, areMirrored);
      if (!same) this.placements.push(placement);
      return new InstanceMesh(part, this.slots, this.spheres, placement);
    });
    root.add(...this.meshes);
  }

  /** Draws an object here from now on. */
  stand(object: number, worldFromObject: Matrix4): void {
    const slot = this.slots.take(object);
    for (const placement of this.placements) placement.stand(slot, worldFromObject);
    const { center, radius } = this.sphere.clone().applyMatrix4(worldFromObject);
    this.spheres.reserve(slot + 1);
    this.spheres.array.set([...center.toArray(), radius], slot * SPHERE);
    this.hasMoved = true;
  }

  remove(object: number): void {
    const slot = this.slots.free(object);
    if (slot === undefined) return;
    this.spheres.move(this.slots.count, slot);
    for (const { matrices } of this.placements) matrices.move(this.slots.count, slot);
    this.hasMoved = true;
  }

  /** Draws what is in view, and nothing else; to be called before each picture. */
  look(view: ViewVolume): void {
    const { seen } = this;
    const { array } = this.spheres;
    let isOther = this.hasMoved || !view.origin.equals(this.origin);
    let [count, nearest, nearest_m] = [0, 0, Number.POSITIVE_INFINITY];
    for (let slot = 0; slot < this.slots.count; slot += 1) {
      const i = slot * SPHERE;
      const [x, y, z] = [array[i] as number, array[i + 1] as number, array[i + 2] as number];
      if (!view.meets(x, y, z, array[i + 3] as number)) continue;
      const depth_m = view.depthOf(x, y, z);
      if (depth_m < nearest_m) {
        nearest = slot;
        nearest_m = depth_m;
      }
      if (seen[count] !== slot) isOther = true;
      seen[count] = slot;
      count += 1;
    }
    seen.length = count;
    this.hasMoved = false;
    this.origin.copy(view.origin);
    if (isOther && count > 0) {
      for (const placement of this.placements) placement.tell(seen, view.origin);
      for (const mesh of this.meshes) mesh.take();
    }
    if (count > 0) for (const placement of this.placements) placement.face(nearest);
    for (const mesh of this.meshes) mesh.draw(count);
    if (count > 0) this.isUnknown = false;
  }

  /** As `look`; answers what draws what stands there, if anything does. */
  castInto(volume: ViewVolume): readonly InstanceMesh[] {
    this.look(volume);
    return this.seen.length > 0 ? this.meshes : [];
  }

  /** Has the next picture give the graphics card what they take, in view or not; answers whether it had not been. */
  introduce(): boolean {
    if (!this.isUnknown) return false;
    this.isUnknown = false;
    for (const placement of this.placements) placement.tell([], this.origin);
    for (const mesh of this.meshes) {
      mesh.take();
      mesh.draw(0, true);
    }
    return true;
  }

  /** Frees what it takes on the graphics card, but neither geometry nor materials. */
  release(): void {
    for (const mesh of this.meshes) mesh.dispose();
  }
}
