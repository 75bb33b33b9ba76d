/**
 * How far is a point from a triangle? The nearest point by the regions of its corners and edges, after Ericson, *Real-Time
 * Collision Detection* (2005), §5.1.5.
 *
 * The same operations in the same order as `crates/scene/src/smooth/select/distance.rs`, so that both find the same bits.
 */

/** The distance of two points: where their three numbers begin. */
export function distanceBetween(at: Float64Array, a: number, b: number): number {
  const x = (at[a] as number) - (at[b] as number);
  const y = (at[a + 1] as number) - (at[b + 1] as number);
  const z = (at[a + 2] as number) - (at[b + 2] as number);
  return Math.sqrt(x * x + y * y + z * z);
}

/** The square of a point's distance from a triangle of three others; may be no number where the triangle has no area. */
export function squareToTriangle(at: Float64Array, p: number, a: number, b: number, c: number): number {
  const abx = (at[b] as number) - (at[a] as number);
  const aby = (at[b + 1] as number) - (at[a + 1] as number);
  const abz = (at[b + 2] as number) - (at[a + 2] as number);
  const acx = (at[c] as number) - (at[a] as number);
  const acy = (at[c + 1] as number) - (at[a + 1] as number);
  const acz = (at[c + 2] as number) - (at[a + 2] as number);
  const apx = (at[p] as number) - (at[a] as number);
  const apy = (at[p + 1] as number) - (at[a + 1] as number);
  const apz = (at[p + 2] as number) - (at[a + 2] as number);
  // From `a`, so far along both edges.
  const along = (s: number, t: number) => {
    const x = apx - s * abx - t * acx;
    const y = apy - s * aby - t * acy;
    const z = apz - s * abz - t * acz;
    return x * x + y * y + z * z;
  };
  const d1 = abx * apx + aby * apy + abz * apz;
  const d2 = acx * apx + acy * apy + acz * apz;
  if (d1 <= 0 && d2 <= 0) return along(0, 0);
  const bpx = (at[p] as number) - (at[b] as number);
  const bpy = (at[p + 1] as number) - (at[b + 1] as number);
  const bpz = (at[p + 2] as number) - (at[b + 2] as number);
  const d3 = abx * bpx + aby * bpy + abz * bpz;
  const d4 = acx * bpx + acy * bpy + acz * bpz;
  if (d3 >= 0 && d4 <= d3) return along(1, 0);
  const vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return along(d1 / (d1 - d3), 0);
  const cpx = (at[p] as number) - (at[c] as number);
  const cpy = (at[p + 1] as number) - (at[c + 1] as number);
  const cpz = (at[p + 2] as number) - (at[c + 2] as number);
  const d5 = abx * cpx + aby * cpy + abz * cpz;
  const d6 = acx * cpx + acy * cpy + acz * cpz;
  if (d6 >= 0 && d5 <= d6) return along(0, 1);
  const vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return along(0, d2 / (d2 - d6));
  const va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const w = (d4 - d3) / (d4 - d3 + (d5 - d6));
    return along(1 - w, w);
  }
  const share = 1 / (va + vb + vc);
  return along(vb * share, vc * share);
}
