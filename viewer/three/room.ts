/** How does a draw call get room for more instances? By another mesh with twice as much as is needed. */
import type { InstancedMesh } from "three";

/** Room for so many more than there are. */
const ROOM = 2;

/** A mesh with room for so many: this one, or else what `make` makes with more room, and this one is gone. */
export function withRoom<M extends InstancedMesh>(
  mesh: M | undefined,
  count: number,
  make: (capacity: number) => M,
): M | undefined {
  if (count <= (mesh?.instanceMatrix.count ?? 0)) return mesh;
  if (mesh) release(mesh);
  const made = make(ROOM * count);
  // Instances are anywhere, and the geometry alone says nothing of where.
  made.frustumCulled = false;
  return made;
}

/** Frees what a mesh takes, but not its material. */
export function release(mesh: InstancedMesh): void {
  mesh.removeFromParent();
  mesh.geometry.dispose();
  mesh.dispose();
}
