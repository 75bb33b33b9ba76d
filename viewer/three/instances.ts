/**
 * How are many objects of one model drawn by one call for each of its parts? Each object has a slot; before each picture those in view
 * are told to the graphics card, and only where they are others than before or stand elsewhere.
 */
import { InstancedBufferAttribute, Matrix4, type Mesh, type Object3D, Sphere } from "three";
import { InstanceMesh, MATRIX, matricesOf, SPHERE } from "./instancemesh.ts";
import { Rows, Slots } from "./slots.ts";
import type { ViewVolume } from "./viewvolume.ts";

/** Turns what is drawn inside out, and is its own inverse. */
const MIRROR = new Matrix4().makeScale(-1, 1, 1);

/** Parts that are at the same place in each object, which share their matrices. */
interface Placement {
  readonly objectFromPart: Matrix4;
  readonly matrices: Rows;
  readonly meshes: InstanceMesh[];
  /** Whether faces are turned inside out, which three.js looks for in the mesh alone, not in its instances. */
  readonly isMirrored: boolean;
  /** Of those in view. */
  attribute: InstancedBufferAttribute;
}

/** Objects of one model that are all mirrored, or none. */
export class Instances {
  private readonly slots = new Slots();
  private readonly spheres = new Rows(SPHERE);
  private readonly placements: Placement[] = [];
  /** Around what is drawn, in an object. */
  private readonly sphere = new Sphere().makeEmpty();
  /** Slots that were in view at the last look. */
  private readonly seen: number[] = [];
  private hasMoved = false;

  /** Parts carry in `matrixWorld` where they are in an object. What is drawn is added to `root`, which stands at the origin. */
  constructor(parts: readonly Mesh[], areMirrored: boolean, root: Object3D) {
    for (const { geometry, material, matrixWorld: objectFromPart } of parts) {
      if (!geometry.boundingSphere) geometry.computeBoundingSphere();
      if (geometry.boundingSphere) this.sphere.union(geometry.boundingSphere.clone().applyMatrix4(objectFromPart));
      const { matrices, isMirrored, meshes } = this.placementAt(objectFromPart, areMirrored);
      const mesh = new InstanceMesh(geometry, material, { slots: this.slots, spheres: this.spheres, matrices });
      if (isMirrored) mesh.matrix.copy(MIRROR);
      meshes.push(mesh);
      root.add(mesh);
      mesh.updateMatrixWorld(true);
    }
  }

  /** Draws an object here from now on. */
  stand(object: number, worldFromObject: Matrix4): void {
    const slot = this.slots.take(object);
    const meshFromPart = new Matrix4();
    for (const { matrices, objectFromPart, isMirrored } of this.placements) {
      meshFromPart.multiplyMatrices(worldFromObject, objectFromPart);
      if (isMirrored) meshFromPart.premultiply(MIRROR);
      matrices.reserve(this.slots.count);
      meshFromPart.toArray(matrices.array, slot * MATRIX);
    }
    const { center, radius } = this.sphere.clone().applyMatrix4(worldFromObject);
    this.spheres.reserve(this.slots.count);
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
    let isOther = this.hasMoved;
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
    for (const placement of this.placements) {
      if (isOther && count > 0) placement.attribute = matricesOf(seen, placement.matrices, placement.attribute);
      for (const mesh of placement.meshes) mesh.draw(placement.attribute, count, nearest);
    }
  }

  /** Frees what it takes on the graphics card, but neither geometry nor materials. */
  release(): void {
    for (const { meshes } of this.placements) for (const mesh of meshes) mesh.dispose();
  }

  private placementAt(objectFromPart: Matrix4, areMirrored: boolean): Placement {
    const same = this.placements.find((placement) => placement.objectFromPart.equals(objectFromPart));
    if (same) return same;
    const placement = {
      objectFromPart,
      matrices: new Rows(MATRIX),
      meshes: [],
      isMirrored: areMirrored !== objectFromPart.determinant() < 0,
      attribute: new InstancedBufferAttribute(new Float32Array(0), MATRIX),
    };
    this.placements.push(placement);
    return placement;
  }
}
