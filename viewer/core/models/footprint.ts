/**
 * How much memory will a level or rung take? Nobody says before it is decoded, so it is estimated from what the same kind
 * took so far, rather a little too much.
 */
import type { Model } from "../documents/modeldocument.ts";
import { filesOf, type Grade } from "../strategy/grade.ts";

/**
 * Memory for each downloaded byte of a level, for each pixel of an impostor, for each triangle of a rung with its decoder,
 * and for each triangle that grew, before anything was learnt.
 */
const FIRST_GUESS = { level: 4, impostor: 10, rung: 400, grown: 90 };
/** Estimates lie this much above the mean. */
const CAUTION = 1.25;

export class Footprint {
  private readonly seen = {
    level: { size: 0, memory_bytes: 0 },
    impostor: { size: 0, memory_bytes: 0 },
    rung: { size: 0, memory_bytes: 0 },
    grown: { size: 0, memory_bytes: 0 },
  };

  learn(model: Model, grade: Grade, memory_bytes: number): void {
    const seen = this.seen[grade.kind];
    seen.size += sizeOf(model, grade);
    seen.memory_bytes += memory_bytes;
  }

  estimate_bytes(model: Model, grade: Grade): number {
    const { size, memory_bytes } = this.seen[grade.kind];
    const ratio = size > 0 ? memory_bytes / size : FIRST_GUESS[grade.kind];
    return Math.ceil(sizeOf(model, grade) * Math.max(1, ratio) * CAUTION);
  }
}

/** What memory goes with: bytes of levels, pixels of impostors, triangles of all else. */
function sizeOf(model: Model, grade: Grade): number {
  if (grade.kind === "rung" || grade.kind === "grown") return grade.triangles;
  if (grade.kind === "impostor" && model.impostor) return 2 * (model.impostor.views * model.impostor.size_px) ** 2;
  return filesOf(model, grade).reduce((sum, { bytes }) => sum + bytes, 0);
}
