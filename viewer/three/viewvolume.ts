/** What can be in the picture? What meets the space between the six sides of a camera's view. */
import { type Camera, Frustum, Matrix4, Vector3, Vector4 } from "three";

/** For each side its normal, inwards, and its distance from the origin. */
const [SIDES, NUMBERS] = [6, 4];
const ORIGINS_M = 64;

export class ViewVolume {
  /**
   * A place near the eye, which seldom changes. Graphics cards count with 24 bits: told where things are from there, they have what is
   * near stand still while one walks, also kilometres from the origin of the world.
   */
  readonly origin: Vector3;
  /** From what is ahead to the eye, of length 1. */
  readonly towards: Vector3;
  private readonly sides = new Float64Array(SIDES * NUMBERS);
  /** The same for the plane of the eye. */
  private readonly ahead: Vector4;

  /** Of a camera whose matrices are up to date. */
  constructor({ matrixWorld, projectionMatrix, matrixWorldInverse, coordinateSystem, reversedDepth }: Camera) {
    this.towards = new Vector3().setFromMatrixColumn(matrixWorld, 2).normalize();
    this.origin = new Vector3()
      .setFromMatrixPosition(matrixWorld)
      .divideScalar(ORIGINS_M)
      .round()
      .multiplyScalar(ORIGINS_M);
    const clipFromWorld = new Matrix4().multiplyMatrices(projectionMatrix, matrixWorldInverse);
    const { planes } = new Frustum().setFromProjectionMatrix(clipFromWorld, coordinateSystem, reversedDepth);
    planes.forEach(({ normal, constant }, i) => {
      this.sides.set([...normal.toArray(), constant], i * NUMBERS);
    });
    const { elements } = matrixWorldInverse;
    this.ahead = new Vector4(elements[2], elements[6], elements[10], elements[14]).negate();
  }

  /** Whether a sphere is in it, at least in part; the same for a few that are just outside its edges. */
  meets(x: number, y: number, z: number, radius: number): boolean {
    const { sides } = this;
    for (let i = 0; i < sides.length; i += NUMBERS) {
      const inside =
        (sides[i] as number) * x +
        (sides[i + 1] as number) * y +
        (sides[i + 2] as number) * z +
        (sides[i + 3] as number);
      if (inside < -radius) return false;
    }
    return true;
  }

  /** How far ahead of the eye a point is. */
  depthOf(x: number, y: number, z: number): number {
    const { ahead } = this;
    return ahead.x * x + ahead.y * y + ahead.z * z + ahead.w;
  }
}
