import { BufferAttribute, BufferGeometry, Camera, InstancedMesh, Mesh, MeshStandardMaterial, Scene } from "three";
import { expect, it } from "vitest";
import { type Preparing, Programs } from "./programs.ts";

const [LINK_STATUS, SYNC_STATUS, SIGNALED, COMPLETION_STATUS_KHR] = [1, 2, 3, 4];

/** A graphics card that has done what it was told to when `done` is set, and notes what makes a page wait for it. */
function graphicsCard({ isParallel = false } = {}) {
  const notes = { compiled: 0, done: false, asked: [] as string[] };
  const gl = {
    LINK_STATUS,
    SYNC_STATUS,
    SIGNALED,
    SYNC_GPU_COMMANDS_COMPLETE: 5,
    flush: () => {},
    isContextLost: () => false,
    getExtension: () => (isParallel ? { COMPLETION_STATUS_KHR } : null),
    fenceSync: () => ({}),
    deleteSync: () => {},
    getSyncParameter: () => (notes.done ? SIGNALED : 0),
    getProgramParameter: (_program: unknown, name: number) => {
      if (name === COMPLETION_STATUS_KHR) return notes.done;
      notes.asked.push(`status, ${notes.done ? "done" : "not done"}`);
      return true;
    },
  };
  const programs: object[] = [];
  const renderer = {
    info: { programs },
    getContext: () => gl,
    compile: () => {
      notes.compiled += 1;
      programs.push({ name: "paint", usedTimes: 1, getUniforms: () => notes.asked.push("uniforms") });
    },
  };
  return { notes, programs, renderer: renderer as unknown as Preparing };
}

const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(9), 3));
const later = (ms: number) => new Promise((over) => setTimeout(over, ms));

it.each([false, true])("a program is asked for nothing before it is compiled (told when: %s)", async (isParallel) => {
  const { notes, programs, renderer } = graphicsCard({ isParallel });
  const prepared = new Programs(renderer, new Scene(), new Camera()).prepare(
    new Mesh(geometry, new MeshStandardMaterial()),
  );
  await later(50);
  expect([notes.compiled, notes.asked]).toEqual([1, []]);
  notes.done = true;
  await prepared;
  expect(notes.asked).toEqual(["status, done", "uniforms"]);
  // It outlives its first material.
  expect(programs).toMatchObject([{ usedTimes: 2 }]);
});

it("a material is prepared once for meshes of one kind", async () => {
  const { notes, renderer } = graphicsCard();
  notes.done = true;
  const programs = new Programs(renderer, new Scene(), new Camera());
  const material = new MeshStandardMaterial();
  for (const mesh of [new Mesh(geometry, material), new Mesh(geometry, material)]) await programs.prepare(mesh);
  expect(notes.compiled).toBe(1);
  await programs.prepare(new InstancedMesh(geometry, material, 0));
  expect(notes.compiled).toBe(2);
});
