/**
 * Where is a part of a model in the world, for each of its objects, and what is the graphics card told of that? Parts that are at the same
 * place in each object share this.
 */
import { DynamicDrawUsage, InstancedBufferAttribute, Matrix4, Sphere, Vector3 } from "three";
import { Rows } from "./slots.ts";

const MATRIX = 16;
/** Where the place begins, and the x of it and of all axes. */
const PLACE = 12;
const X = [0, 4, 8, PLACE];

/** Matrices by slot. */
class Matrices extends Rows {
  constructor() {
    super(MATRIX);
  }

  at(slot: number): Matrix4 {
    return new Matrix4().fromArray(this.array, slot * MATRIX);
  }
}

export class Placement {
  /** From the part in each object to the world. */
  readonly matrices = new Matrices();
  /** What the graphics card is told: from the part to the mesh, of some objects in turn. */
  attribute = new InstancedBufferAttribute(new Float32Array(0), MATRIX);
  /** From the mesh that draws all of them: it says for them whether they turn faces inside out, since three.js does not look at instances. */
  readonly worldFromMesh = new Matrix4();
  /** Where in that mesh the nearest of them is, by which three.js draws near meshes first. */
  readonly nearest = new Sphere();
  private readonly origin = new Vector3();
  private readonly isMirrored: boolean;

  /** `areMirrored` says whether all objects are, or none. */
  constructor(
    readonly objectFromPart: Matrix4,
    areMirrored: boolean,
  ) {
    this.isMirrored = areMirrored !== objectFromPart.determinant() < 0;
  }

  stand(slot: number, worldFromObject: Matrix4): void {
    this.matrices.reserve(slot + 1);
    new Matrix4().multiplyMatrices(worldFromObject, this.objectFromPart).toArray(this.matrices.array, slot * MATRIX);
  }

  /** Says which slot of those that were told is nearest. */
  face(slot: number): void {
    const { center } = this.nearest;
    center.fromArray(this.matrices.array, slot * MATRIX + PLACE).sub(this.origin);
    if (this.isMirrored) center.x = -center.x;
  }

  /** Tells of these slots and no others, counting from `origin`. */
  tell(slots: readonly number[], origin: Vector3): void {
    const [from, room] = [this.matrices.array, this.attribute.array.length];
    // For all, not only for those in view: who turns round sees many more at once.
    if (from.length > room) {
      this.attribute = new InstancedBufferAttribute(new Float32Array(from.length), MATRIX).setUsage(DynamicDrawUsage);
    }
    this.origin.copy(origin);
    this.worldFromMesh.makeScale(this.isMirrored ? -1 : 1, 1, 1).setPosition(origin);
    const to = this.attribute.array;
    const offset = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, origin.x, origin.y, origin.z, 0];
    let end = 0;
    for (const slot of slots) {
      for (let k = 0; k < MATRIX; k += 1) {
        to[end + k] = (from[slot * MATRIX + k] as number) - (offset[k] as number);
      }
      if (this.isMirrored) for (const k of X) to[end + k] = -(to[end + k] as number);
      end += MATRIX;
    }
    this.attribute.clearUpdateRanges();
    this.attribute.addUpdateRange(0, end);
    this.attribute.needsUpdate = true;
  }
}
