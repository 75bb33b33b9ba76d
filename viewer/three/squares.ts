/**
 * What is told of each square that shows an impostor? Where it stands, which moment of its movement it shows, its tint, and,
 * before each picture, from where the eye looks and which views that takes.
 */
import {
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedMesh,
  type Material,
  Matrix4,
  PlaneGeometry,
  Vector3,
} from "three";
import type { Vec3 } from "../core/basics/geometry.ts";
import { directionOf, viewsAround } from "../core/documents/impostors.ts";
import type { Drawable } from "./impostormaterial.ts";

/** Numbers for each object: where the eye is, three views with their numbers, their weights, and its tint. */
const ATTRIBUTES = { towards: 3, viewA: 4, viewB: 4, viewC: 4, viewWeights: 3, tint: 3 } as const;
const VIEWS = ["viewA", "viewB", "viewC"] as const;

/** How one object is shown. */
export interface Showing {
  /** Moment of its movement. */
  readonly frame: number;
  /** Linear light, for what of its colour is not its own. */
  readonly tint: readonly [number, number, number];
}

/** Of what keeps still and is worn by nobody. */
const AS_PUBLISHED: Showing = { frame: 0, tint: [1, 1, 1] };

/** All objects that are drawn by one impostor: one draw call. */
export class Squares extends InstancedMesh {
  private readonly directions: readonly Vec3[];
  private readonly objectsFromWorld: Matrix4[] = [];
  private readonly frames: number[] = [];
  private readonly numbers: Record<keyof typeof ATTRIBUTES, InstancedBufferAttribute>;

  constructor(
    material: Material,
    private readonly impostor: Drawable,
    capacity: number,
  ) {
    const geometry = new PlaneGeometry(2, 2);
    super(geometry, material, capacity);
    this.matrixAutoUpdate = false;
    this.receiveShadow = true;
    const attribute = (size: number) =>
      new InstancedBufferAttribute(new Float32Array(size * capacity), size).setUsage(DynamicDrawUsage);
    this.numbers = {
      towards: attribute(ATTRIBUTES.towards),
      viewA: attribute(ATTRIBUTES.viewA),
      viewB: attribute(ATTRIBUTES.viewB),
      viewC: attribute(ATTRIBUTES.viewC),
      viewWeights: attribute(ATTRIBUTES.viewWeights),
      tint: attribute(ATTRIBUTES.tint),
    };
    for (const [name, numbers] of Object.entries(this.numbers)) geometry.setAttribute(name, numbers);
    const { mapping, views } = impostor;
    this.directions = Array.from({ length: views * views }, (_, number) =>
      directionOf(mapping, (number % views) / (views - 1), Math.floor(number / views) / (views - 1)),
    );
  }

  /** Places one of the first `count`. */
  stand(i: number, worldFromObject: Matrix4, { frame, tint }: Showing = AS_PUBLISHED): void {
    this.setMatrixAt(i, worldFromObject);
    this.instanceMatrix.needsUpdate = true;
    this.objectsFromWorld[i] = (this.objectsFromWorld[i] ?? new Matrix4()).copy(worldFromObject).invert();
    this.frames[i] = frame;
    this.numbers.tint.setXYZ(i, ...tint);
  }

  /** Turns the first `count` to an eye. */
  look(eye: Vec3): void {
    if (this.count === 0) return;
    const { mapping, views, centre } = this.impostor;
    const middle = new Vector3(...centre);
    const at = new Vector3();
    const { towards, viewWeights } = this.numbers;
    for (let i = 0; i < this.count; i += 1) {
      const objectFromWorld = this.objectsFromWorld[i];
      if (!objectFromWorld) continue;
      at.set(...eye)
        .applyMatrix4(objectFromWorld)
        .sub(middle)
        .normalize();
      towards.setXYZ(i, at.x, at.y, at.z);
      const around = viewsAround(mapping, [at.x, at.y, at.z], views);
      around.forEach(({ column, row }, k) => {
        const number = row * views + column;
        const [x, y, z] = this.directions[number] ?? [0, 1, 0];
        this.numbers[VIEWS[k] ?? "viewA"].setXYZW(i, x, y, z, number + (this.frames[i] ?? 0) * views * views);
      });
      viewWeights.setXYZ(i, around[0].weight, around[1].weight, around[2].weight);
    }
    for (const attribute of Object.values(this.numbers)) attribute.needsUpdate = true;
  }
}
