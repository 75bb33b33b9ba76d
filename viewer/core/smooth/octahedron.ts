/**
 * How is a direction two small numbers? As a point on an octahedron that is unfolded into a square (Meyer et al. 2010).
 * Numbers go from −127 to 127; whole numbers throughout.
 */
const REACH = 127;

/** The direction of a point, not of unit length: the sizes of its components add up to 127. Written to `to`. */
export function direction(x: number, y: number, to: Float64Array): void {
  const u = Math.max(-REACH, Math.min(REACH, x));
  const v = Math.max(-REACH, Math.min(REACH, y));
  const z = REACH - Math.abs(u) - Math.abs(v);
  to[0] = z >= 0 ? u : fold(u, v);
  to[1] = z >= 0 ? v : fold(v, u);
  to[2] = z;
}

/** The point of a direction of any length; that of +z for none. Written to `to`. */
export function nearest(x: number, y: number, z: number, to: Int32Array): void {
  const reach = Math.abs(x) + Math.abs(y) + Math.abs(z);
  const u = reach === 0 ? 0 : rounded(x, reach);
  const v = reach === 0 ? 0 : rounded(y, reach);
  to[0] = z >= 0 ? u : fold(u, v);
  to[1] = z >= 0 ? v : fold(v, u);
}

function rounded(part: number, reach: number): number {
  return Math.sign(part) * Math.floor((2 * Math.abs(part) * REACH + reach) / (2 * reach));
}

/** Folds the lower half over an edge: the sign of 0 is +. */
function fold(x: number, y: number): number {
  const far = REACH - Math.abs(y);
  return x < 0 ? -far : far;
}
