/** What can be in the picture? What meets the space between the six sides of a camera's view. */
import { type Camera, Frustum, Matrix4 } from "three";

/** For each side its normal, inwards, and its distance from the origin. */
const [SIDES, NUMBERS] = [6, 4];

export class ViewVolume {
  private readonly sides = new Float64Array(SIDES * NUMBERS);
  /** The same for the plane of the eye. */
  private readonly ahead: readonly [number, number, number, number];

  /** Of a camera whose matrices are up to date. */
  constructor({ projectionMatrix, matrixWorldInverse, coordinateSystem, reversedDepth }: Camera) {
    const clipFromWorld = new Matrix4().multiplyMatrices(projectionMatrix, matrixWorldInverse);
    const { planes } = new Frustum().setFromProjectionMatrix(clipFromWorld, coordinateSystem, reversedDepth);
    planes.forEach(({ normal, constant }, i) => {
      this.sides.set([...normal.toArray(), constant], i * NUMBERS);
    });
    const { elements } = matrixWorldInverse;
    this.ahead = [-elements[2], -elements[6], -elements[10], -elements[14]];
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
    const [a, b, c, d] = this.ahead;
    return a * x + b * y + c * z + d;
  }
}
